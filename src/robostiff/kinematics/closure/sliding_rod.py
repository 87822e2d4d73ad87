"""Closed form for a slide along the axes of a planar leg: PRRR and CRR with parallel axes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robostiff.kinematics.closure.rod import Rod, recognise_rod
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.model import Elbow

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

    def with_sign_of(self, elbow: Elbow, R_home: np.ndarray, p_home: np.ndarray) -> SlidingRod:
        """The same leg, its root chosen by name or by the home configuration."""
        e = self.slide.axis
        p_home = p_home - ((p_home - self.rod.skeleton.p_end) @ e) * e
        return replace(self, rod=self.rod.with_sign_of(elbow, R_home, p_home))


def recognise_sliding_rod(skeleton: Skeleton) -> SlidingRod | None:
    """The closed form, its root still open, when the leg is of this kind."""
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
