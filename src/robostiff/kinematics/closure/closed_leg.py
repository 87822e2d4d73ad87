"""A closed leg: where its bodies are, how far its slides are out, and the angles between bodies."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.kinematics.closure.body import LegBody
from robostiff.kinematics.closure.vectors import angle_of, cross, dot
from robostiff.model import TelescopicBeam
from robostiff.spatial import cross as cross_of_entries


@dataclass(frozen=True)
class Stretch:
    """Coordinate of a slide [m] from a length: ``length + offset``."""

    length: Any
    offset: Any

    @property
    def coordinate(self) -> Any:
        """The coordinate itself."""
        return self.length + self.offset

    def of(self, beam: TelescopicBeam) -> Any:
        """Length of a beam of the telescope that slides."""
        return self.length * beam.share + (beam.fixed + beam.share * self.offset)


@dataclass(frozen=True)
class ClosedLeg:
    """Bodies of a closed leg; joints and places are those of the main path of its chain."""

    bodies: dict[int, LegBody]  # a body begins after that many elementary joints
    # dict of int to (3,): axes of spherical joints, which may have any three
    ball_axes: dict[int, np.ndarray]
    # Squares that vanish when the leg closes. Of numbers at poses nothing is kept here: gaps of the
    # placed chain say more.
    misses: list[Any]
    # Positive where the leg is too short or too long, or its axes cannot reach the directions
    out_of_reach: list[Any]
    slides: dict[int, Stretch] = field(default_factory=dict)  # by place in the coordinate vector
    loss: Any = 0  # digits that the closure loses

    def after(self, joints: int) -> LegBody:
        """The body that follows so many elementary joints."""
        return self.bodies[max(start for start in self.bodies if start <= joints)]

    def angle(self, place: int, axis: np.ndarray, ahead: np.ndarray, across: np.ndarray) -> Any:
        """Angle of the turn at a place about an axis, from one direction across it to another.

        At zero coordinates: axis of the joint, `ahead` of the body before it, `across` of that
        after it (3,).
        """
        near, far = self.after(place), self.after(place + 1)
        before, after = near.direction(ahead), far.direction(across)
        sine = dot(near.direction(axis), cross(before, after))
        return angle_of(sine, dot(before, after))

    def nearest_angle(self, place: int, axis: np.ndarray, across: np.ndarray) -> np.ndarray:
        """As `angle`, also where the bodies do not agree on the axis: what leaves least between.

        That is the angle of ``sin = e.vee(R) / 2, cos = (tr R - 1) / 2`` at poses.
        """
        near, far = self.after(place), self.after(place + 1)
        triad = across, cross_of_entries(axis, across), axis
        (x, y, z), (u, v, w) = ([body.direction(e) for e in triad] for body in (near, far))
        return angle_of(dot(y, u) - dot(x, v), dot(x, u) + dot(y, v) + dot(z, w) - 1.0)
