"""A platform in cables with locked winches, displaced: tensions, slack, and what holds it there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.cables.stiffness_matrix import (
    PlacedCables,
    elastic_stiffness,
    geometric_stiffness,
    structure_matrix,
    weight_stiffness,
    weight_wrench,
)
from robostiff.spatial.rotation import matrix_of_rotation


@dataclass(frozen=True)
class Hanging:
    """A platform in cables whose winches are locked, at some displacement from a first pose."""

    placed: PlacedCables  # at the first pose, a single one
    axial: np.ndarray  # (m,): stiffness of every cable [N/m]
    # (m,): length from exit point to attachment below which a cable is slack [m]
    slack_lengths: np.ndarray
    shift: np.ndarray  # (3,): displacement of the reference point [m]
    R: np.ndarray  # (3, 3): rotation since the first pose

    @classmethod
    def at_rest(cls, placed: PlacedCables, axial: np.ndarray, tensions: np.ndarray) -> Hanging:
        """The platform at the first pose, where the cables have given tensions (m,) [N]."""
        slack = placed.lengths - tensions / axial
        return cls(placed, axial, slack, np.zeros(3), np.eye(3))

    @cached_property
    def now(self) -> PlacedCables:
        """The cables at the present displacement."""
        origin = self.placed.reference_point
        return replace(
            self.placed,
            attachments=origin + self.shift + self.placed.arms @ self.R.T,
            reference_point=origin + self.shift,
            weight_point=origin + self.shift + self.R @ self.placed.weight_arm,
        )

    @cached_property
    def pulls(self) -> np.ndarray:
        """Stiffness times stretch (m,) [N]: the tension, or negative for a slack cable."""
        return self.axial * (self.now.lengths - self.slack_lengths)

    @cached_property
    def tensions(self) -> np.ndarray:
        """Tensions (m,) [N]; zero for slack cables."""
        return np.maximum(self.pulls, 0.0)

    @cached_property
    def holding(self) -> np.ndarray:
        """Wrench that must be applied to hold the platform here (n,) [N, N m]."""
        now = self.now
        return -(structure_matrix(now) @ self.tensions + weight_wrench(now))

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Second derivative of the energy (n, n), of the cables that are taut."""
        now, pulls = self.now, self.pulls
        taut = np.where(pulls >= 0, self.axial, 0.0)
        return (
            elastic_stiffness(now, taut)
            + geometric_stiffness(now, np.maximum(pulls, 0.0))
            + weight_stiffness(now)
        )

    def moved(self, x: np.ndarray) -> Hanging:
        """Displaced by a translation of the reference point and then a turn about it (n,)."""
        six = np.zeros(6)
        six[list(self.placed.space.rows)] = x
        turn = matrix_of_rotation(six[3:])
        return replace(self, shift=self.shift + six[:3], R=turn @ self.R)
