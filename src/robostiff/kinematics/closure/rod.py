"""Closed form for a rod on a slide or a crank: PUU, PUS, RUU, RUS, planar RRR, PRR and PRRR."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.kinematics.closure.body import LegBody, tidied
from robostiff.kinematics.closure.closed_form import RodForm, joints_of
from robostiff.kinematics.closure.closed_leg import ClosedLeg, Stretch
from robostiff.kinematics.closure.drive import Circle, circle_of, driven_by_crank, driven_by_slide
from robostiff.kinematics.closure.rod_ends import RodEnds, fits, placed_rod
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.kinematics.closure.vectors import cross, dot, quotient
from robostiff.record import square_root

# Of the rod: nearer than this to the crank's axis, its far end leaves few digits of the angle.
_ON_AXIS = 1e-6
_PARALLEL = 1e-9


@dataclass(frozen=True)
class Rod(RodForm):
    """A slide or crank that carries joint A, and a rod from A to joint B."""

    drive: Slide | Cluster
    # A slide along the axis of the crank that carries all this; it decouples from the rest, which
    # moves in a plane
    across: Slide | None = None

    @property
    def leading(self) -> int:
        """Place of the drive's coordinate."""
        return self.drive.place if isinstance(self.drive, Slide) else self.drive.places[0]

    @property
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles."""
        driven = (self.drive,) if isinstance(self.drive, Cluster) else ()
        return (*driven, *super().turning)

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        A, B = self.joints.A, self.joints.B
        B_now = self.named(platform.point(B.point), "B")
        bodies, slides = {0: base}, {}
        if self.across is not None:
            e = base.direction(self.across.axis)
            s = dot(e, B_now - base.point(B.point))
            slides[self.across.place] = Stretch(s, 0)
            base = base.at(A.point, base.point(A.point) + e * s)
            bodies[self.across.place + 1] = base
        A_to_B = B.point - A.point
        square = A_to_B @ A_to_B
        sign = self.mode.root
        if isinstance(self.drive, Slide):
            drive = driven_by_slide(base, self.drive, A.point, B_now, square, sign)
            slides[self.drive.place] = Stretch(self.named(drive.slide, "s"), 0)
        else:
            drive = driven_by_crank(base, self._circle, B_now, square, sign)
        bodies[self.leading + 1] = drive.carrier
        size = square_root(square)
        if base.is_at_poses:  # out of reach, the rod does not end at B
            size = np.sqrt(dot(drive.A_to_B, drive.A_to_B))
        d = self.named(quotient(drive.A_to_B, size), "d")
        ends = RodEnds(self.joints, drive.carrier, platform, d, drive.A_now, B_now, self.mode)
        rod = placed_rod(ends)
        return replace(
            rod,
            bodies={**bodies, **rod.bodies},
            slides=slides,
            out_of_reach=[*rod.out_of_reach, drive.out_of_reach],
            loss=drive.loss,
        )

    @cached_property
    def _circle(self) -> Circle:
        """That of the near end of the rod, where a crank drives it."""
        crank, *_ = self.turning
        return circle_of(crank, self.joints.A.point)

    def leaves_drive_open(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Where the far end of the rod is on the axis of the crank, which may then turn (N,).

        A drive that slides always follows from the pose.
        """
        if isinstance(self.drive, Slide):
            return np.zeros(len(p), dtype=bool)
        A, B = self.joints.A.point, self.joints.B.point
        arm = self.platform_at(R, p).point(B) - self.drive.point[:, None]
        off_axis = cross(self.drive.axes[0][:, None], arm)
        return np.sqrt(dot(off_axis, off_axis)) <= _ON_AXIS * np.linalg.norm(B - A)


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
        if not turning or np.linalg.norm(np.cross(drive.axes[0], arm)) <= skeleton.rounding:
            return None
    rod = B.point - A.point
    size = np.linalg.norm(rod)
    if size <= skeleton.rounding or not fits(A, B, rod / size):
        return None
    return Rod(skeleton, joints_of(skeleton, A, B, tidied(rod / size).astype(float)), drive)


def recognise_sliding_rod(skeleton: Skeleton) -> Rod | None:
    """The closed form of a crank and a rod in a plane, and a slide across the plane."""
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
    return None if rod is None else replace(rod, across=slide)
