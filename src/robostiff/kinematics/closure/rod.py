"""Closed form for a rod on a slide or a crank: PUU, PUS, RUU, RUS, planar RRR, PRR and PRRR."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from robostiff.kinematics.closure.assembly import Mode
from robostiff.kinematics.closure.pointing import Sign, fits, has_two_ways, point_and_take_up
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.kinematics.closure.strut import _coordinates
from robostiff.kinematics.turn import turn_about
from robostiff.spatial import cross
from robostiff.spatial.batch import product, transposed

# Of the rod: nearer than this to the crank's axis, its far end leaves few digits of the angle.
_ON_AXIS = 1e-6


@dataclass(frozen=True)
class Rod:
    """A slide or crank that carries joint A, and a rod from A to joint B."""

    skeleton: Skeleton
    drive: Slide | Cluster
    A: Cluster
    B: Cluster
    mode: Mode = field(default_factory=Mode)

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""
        return (True, *has_two_ways(self.A, self.B, None))

    @property
    def leading(self) -> int:
        """Place of the drive's coordinate, which the first sign decides."""
        return self.drive.place if isinstance(self.drive, Slide) else self.drive.places[0]

    def in_mode(self, mode: Mode) -> Rod:
        """The same leg in another assembly mode."""
        return replace(self, mode=mode)

    def solve(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (..., size) that bring the end frame to (R, p) in the leg's base frame."""
        skeleton = self.skeleton
        R_wanted = product(R, skeleton.R_end.T)
        B = p + np.einsum("...ij,j->...i", R_wanted, self.B.point - skeleton.p_end)
        q = _coordinates(skeleton.home, p.shape[:-1])
        rod = self.B.point - self.A.point
        if isinstance(self.drive, Slide):
            s = slide_coordinate(self.drive.axis, self.A.point, B, rod, self.mode.root)
            q[..., self.drive.place] = s
            A_to_B = B - self.A.point - s[..., None] * self.drive.axis
            R_left = R_wanted
        else:
            axis = self.drive.axes[0]
            s = crank_coordinate(axis, self.drive.point, self.A.point, B, rod, self.mode.root)
            q[..., self.drive.places[0]] = s
            R_crank = turn_about(axis, s)
            arm = np.einsum("...ij,j->...i", R_crank, self.A.point - self.drive.point)
            A_to_B = np.einsum("...ji,...j->...i", R_crank, B - self.drive.point - arm)
            R_left = product(transposed(R_crank), R_wanted)
        size = np.sqrt(np.einsum("...i,...i->...", A_to_B, A_to_B))
        direction = A_to_B / np.where(size > 0, size, 1.0)[..., None]
        along = rod / np.linalg.norm(rod)
        point_and_take_up(q, self.A, self.B, along, direction, R_left, None, self.mode)
        return q

    def leaves_drive_open(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Where the far end of the rod is on the axis of the crank, which may then turn (...)."""
        if isinstance(self.drive, Slide):
            return np.zeros(p.shape[:-1], dtype=bool)
        skeleton = self.skeleton
        R_wanted = product(R, skeleton.R_end.T)
        B = p + np.einsum("...ij,j->...i", R_wanted, self.B.point - skeleton.p_end)
        off_axis = cross(np.broadcast_to(self.drive.axes[0], B.shape), B - self.drive.point)
        size = np.linalg.norm(self.B.point - self.A.point)
        return np.sqrt(np.einsum("...i,...i->...", off_axis, off_axis)) <= _ON_AXIS * size


def slide_coordinate(
    e: np.ndarray, A: np.ndarray, B: np.ndarray, rod: np.ndarray, sign: Sign
) -> np.ndarray:
    """Slide s with |B - A - s e| = |rod|, s = e.(B - A) +- sqrt(|rod|^2 - |across|^2) (...) [m].

    Where the rod is too short, the slide that brings it nearest.
    """
    A_to_B = B - A
    along = np.einsum("...i,i->...", A_to_B, e)
    across = A_to_B - along[..., None] * e
    square = rod @ rod - np.einsum("...i,...i->...", across, across)
    return along + sign * np.sqrt(np.maximum(square, 0.0))


def crank_coordinate(
    e: np.ndarray, centre: np.ndarray, A: np.ndarray, B: np.ndarray, rod: np.ndarray, sign: Sign
) -> np.ndarray:
    """Crank angle s with |B - A(s)| = |rod|, from a cos s + b sin s = c (...) [rad].

    Where the rod is too short or too long, the angle that brings it nearest.
    """
    arm = A - centre
    level = e * (e @ arm)
    arm_across = arm - level
    to_B = B - centre
    a = 2 * to_B @ arm_across
    b = 2 * to_B @ np.cross(e, arm_across)
    gap = to_B - level
    c = np.einsum("...i,...i->...", gap, gap) + arm_across @ arm_across - rod @ rod
    size = np.hypot(a, b)
    swing = np.arccos(np.clip(c / np.where(size > 0, size, 1.0), -1.0, 1.0))
    s = np.arctan2(b, a) + sign * swing
    return np.arctan2(np.sin(s), np.cos(s))


def recognise_rod(skeleton: Skeleton) -> Rod | None:
    """The closed form, when the leg is of this kind."""
    match skeleton.parts:
        case (Slide() | Cluster() as drive, Cluster() as A, Cluster() as B):
            pass
        case _:
            return None
    if isinstance(drive, Cluster):
        arm = A.point - drive.point
        turning = not drive.is_ball and len(drive.axes) == 1
        if not turning or np.linalg.norm(np.cross(drive.axes[0], arm)) == 0:
            return None
    rod = B.point - A.point
    size = np.linalg.norm(rod)
    if size == 0 or not fits(A, B, rod / size):
        return None
    return Rod(skeleton, drive, A, B)


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
