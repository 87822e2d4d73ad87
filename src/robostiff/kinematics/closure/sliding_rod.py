"""Closed form for a slide along the axes of a planar leg: PRRR and CRR with parallel axes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.kinematics.closure.assembly import Mode
from robostiff.kinematics.closure.rod import Rod, recognise_rod
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide

_PARALLEL = 1e-9


@dataclass(frozen=True)
class SlidingRod:
    """A crank and a rod in a plane, and a slide across the plane that decouples from them.

    Attributes
    ----------
    slide : Slide
    rod : Rod
        The leg with the slide held at zero.
    """

    slide: Slide
    rod: Rod

    def solve(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (..., size) that bring the end frame to (R, p) in the leg's base frame."""
        e = self.slide.axis
        # Turns about e leave the part of the end along e to the slide alone.
        s = (p - self.rod.skeleton.p_end) @ e
        q = self.rod.solve(R, p - s[..., None] * e)
        q[..., self.slide.place] = s
        return q

    def leaves_drive_open(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Where the far end of the rod is on the axis of the crank, which may then turn (...)."""
        return self.rod.leaves_drive_open(R, p)

    @property
    def mode(self) -> Mode:
        """Assembly mode."""
        return self.rod.mode

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""
        return self.rod.signs

    @property
    def leading(self) -> int:
        """Place of the crank's coordinate, which the first sign decides."""
        return self.rod.leading

    def in_mode(self, mode: Mode) -> SlidingRod:
        """The same leg in another assembly mode."""
        return replace(self, rod=self.rod.in_mode(mode))


def recognise_sliding_rod(skeleton: Skeleton) -> SlidingRod | None:
    """The closed form, when the leg is of this kind."""
    match skeleton.parts:
        case (Slide() as slide, Cluster() as crank, Cluster() as A, Cluster() as B):
            joints = (crank, A, B)
        case _:
            return None
    for joint in joints:
        if joint.is_ball or len(joint.axes) != 1:
            return None
        if np.linalg.norm(np.cross(joint.axes[0], slide.axis)) > _PARALLEL:
            return None
    rod = recognise_rod(replace(skeleton, parts=joints))
    return None if rod is None else SlidingRod(slide, rod)
