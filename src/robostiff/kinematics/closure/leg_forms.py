"""Legs in closed form: a strut of variable length, a rod on a slide or a crank, a post."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from robostiff.kinematics.closure.assembly import RootSigns
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    Stretch,
    body_of_directions,
    body_turned,
    constant_cosine,
    cross,
    direction_across,
    dot,
    quotient,
    rest_of_directions,
    root,
    tidied,
    tidied_point,
)
from robostiff.kinematics.closure.rod_ends import (
    Circle,
    RodEnds,
    RodJoints,
    circle_of,
    driven_by_crank,
    driven_by_slide,
    fits,
    placed_rod,
)
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton, Slide
from robostiff.record import Entry, square_root
from robostiff.spatial.rotation import vector_of_rotation


@dataclass(frozen=True)
class LegForm(ABC):
    """A leg of a kind that closes without iteration: one formula for records and for poses."""

    skeleton: Skeleton
    mode: RootSigns = field(default_factory=RootSigns, kw_only=True)
    # Of the leg, where steps of a record are to be named
    name: str | None = field(default=None, kw_only=True)

    @abstractmethod
    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""

    @property
    @abstractmethod
    def leading(self) -> int:
        """Place of the coordinate that the first sign of a mode decides."""

    @property
    @abstractmethod
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""

    @property
    @abstractmethod
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles, from base to platform."""

    def in_mode(self, mode: RootSigns) -> Self:
        """The same leg in another assembly mode."""
        return replace(self, mode=mode)

    def solve(self, R: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Coordinates (N, size) that bring the end frame to (R, p) in the leg's base frame.

        Where it is out of reach, those that bring it near.
        """
        closed = self.closed(self._at_rest[0], self.platform_at(R, p))
        q = np.empty((self.skeleton.home.size, len(p)))
        q[...] = self.skeleton.home[:, None]
        for place, stretch in closed.slides.items():
            q[place] = stretch.coordinate
        last = self.turning[-1].places[-1]  # which takes what is left
        for place, axis, across in self._turns:
            if place == last:
                q[place] = closed.nearest_angle(place, axis, across)
            else:
                q[place] = closed.angle(place, axis, across, across)
        for cluster, own in self._balls:
            near, far = closed.after(cluster.places[0]), closed.after(cluster.places[-1] + 1)
            turn = near.turn_to(far, own).transpose(2, 0, 1)
            q[cluster.places[0] : cluster.places[-1] + 1] = vector_of_rotation(turn).T
        return q.T

    def platform_at(self, R: np.ndarray, p: np.ndarray) -> LegBody:
        """The end frame at poses (N, 3, 3) and (N, 3)."""
        return LegBody(self._at_rest[1], R.transpose(1, 2, 0), p.T)

    def named(self, value: Any, name: str) -> Any:
        """The same entry, or vector of entries, with a name; components get _x, _y and _z."""
        if self.name is None:
            return value
        parts = zip(value, ("_x", "_y", "_z"), strict=True) if isinstance(value, np.ndarray) else ()
        for part, axis in parts or ((value, ""),):
            if isinstance(part, Entry):
                part.named(f"{name}_{self.name}{axis}")
        return value

    @cached_property
    def _at_rest(self) -> tuple[LegBody, Rest]:
        """The base, which stays where it is, and the end frame."""
        base = LegBody(Rest(np.eye(3), np.zeros(3)), np.eye(3)[..., None], np.zeros((3, 1)))
        return base, Rest(self.skeleton.R_end, self.skeleton.p_end)

    @cached_property
    def _turns(self) -> tuple[tuple[int, np.ndarray, np.ndarray], ...]:
        """Place and axis of each turn, and a direction across it."""
        found = list(self._single_turns())
        return tuple((place, axis, direction_across(axis).astype(float)) for place, axis in found)

    def _single_turns(self) -> Iterator[tuple[int, np.ndarray]]:
        for cluster in self.turning:
            if not cluster.is_ball:
                yield from zip(cluster.places, cluster.axes, strict=True)

    @cached_property
    def _balls(self) -> tuple[tuple[Cluster, np.ndarray], ...]:
        """Spherical joints, and their own axes at zero coordinates as columns."""
        balls = (cluster for cluster in self.turning if cluster.is_ball)
        return tuple((cluster, np.stack(cluster.axes, axis=-1)) for cluster in balls)


@dataclass(frozen=True)
class RodForm(LegForm):
    """A leg with a rod between two joints."""

    joints: RodJoints  # the rod, and the joints at its ends

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are: a joint of two axes does its part in two ways."""
        A, B, turned = self.joints.A, self.joints.B, self.joints.turned_by_second
        return True, not A.is_ball and len(A.axes) == 2, turned and len(B.axes) == 2

    @property
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles, from base to platform."""
        return (self.joints.A, self.joints.B)

    def _single_turns(self) -> Iterator[tuple[int, np.ndarray]]:
        yield from super()._single_turns()
        if self.joints.spin is not None:
            yield self.joints.spin, self.joints.along


def joints_of(
    skeleton: Skeleton, A: Cluster, B: Cluster, along: np.ndarray, spin: int | None = None
) -> RodJoints:
    """The joints of a rod in numbers."""
    side = direction_across(along).astype(float)
    return RodJoints(A, B, along, spin, skeleton.home, side)


@dataclass(frozen=True)
class Strut(RodForm):
    """A slide along the line from joint A to joint B, perhaps with a turn about it.

    Its length, the fixed one and the slide's coordinate, has the sign that its mode says.
    """

    slide: Slide

    @property
    def leading(self) -> int:
        """Place of the slide."""
        return self.slide.place

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        joints, place = self.joints, self.slide.place
        A, B = joints.A, joints.B
        A_now, B_now = base.point(A.point), self.named(platform.point(B.point), "B")
        A_to_B = B_now - A_now
        length = self.named(root(dot(A_to_B, A_to_B)) * self.mode.root, "L")
        d = self.named(quotient(A_to_B, length), "d")
        rod = placed_rod(RodEnds(joints, base, platform, d, A_now, B_now, self.mode))
        (fixed,) = tidied_point(np.array([joints.along @ (B.point - A.point)], dtype=object))
        carried = rod.bodies[A.places[-1] + 1].at(B.point, B_now)
        bodies = {0: base, place + 1: carried, **rod.bodies}
        return replace(rod, bodies=bodies, slides={place: Stretch(length, -fixed)})


def recognise_strut(skeleton: Skeleton) -> Strut | None:
    """The closed form, when the leg is of this kind."""
    spin = None
    match skeleton.parts:
        case (Cluster() as A, Slide() as slide, Cluster() as B):
            pass
        case (Cluster() as A, Slide() as slide, Cluster() as turn, Cluster() as B):
            if turn.is_ball or len(turn.axes) != 1:
                return None
            if np.linalg.norm(turn.axes[0] - slide.axis) >= _PARALLEL:
                return None
            spin = turn.places[0]
        case _:
            return None
    along = slide.axis
    A_to_B = B.point - A.point
    size = 1e-9 * (np.linalg.norm(A_to_B) + np.linalg.norm(skeleton.p_end) + 1e-300)
    if np.linalg.norm(np.cross(along, A_to_B)) > size or not fits(A, B, along):
        return None
    return Strut(skeleton, joints_of(skeleton, A, B, along, spin), slide)


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


@dataclass(frozen=True)
class Post(LegForm):
    """A leg whose only joint turns about one point, and takes the turn that the pose has.

    It closes where the point is in the same place on the base and on the platform, and where axes
    of the joint take the turn, in one way.
    """

    joint: Cluster
    length: float = 1.0  # against which the distance of the two places counts [m]

    @property
    def leading(self) -> int:
        """Place of the first coordinate."""
        return self.joint.places[0]

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """None."""
        return False, False, False

    @property
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles."""
        return (self.joint,)

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform."""
        joint, at = self.joint, base.point(self.joint.point)
        near = [base.direction(axis) for axis in joint.axes]
        far = platform.direction(joint.axes[-1])
        bodies, ball_axes = {0: base, joint.places[-1] + 1: platform}, {}
        missed = [(platform.point(joint.point) - at) * (1 / self.length)]
        if joint.is_ball:
            ball_axes = dict(zip(joint.places, near, strict=True))
        elif len(joint.axes) == 1:
            missed.append(far - near[0])
        else:
            missed.append(np.array([dot(near[0], far) - constant_cosine(*joint.axes)]))
            a, b = joint.axes
            if base.is_at_poses:
                rest, _ = rest_of_directions(joint.point, a, b)
                between = body_turned(base, rest, at, a, b, far)
            else:
                between = body_of_directions((joint.point, a, b), (at, near[0], far))
            bodies[joint.places[1]] = between
        closing = [] if base.is_at_poses else [v @ v for v in map(tidied, missed)]
        return ClosedLeg(bodies, ball_axes, closing, [])


def recognise_post(skeleton: Skeleton) -> Post | None:
    """The closed form, when the leg is of this kind."""
    match skeleton.parts:
        case (Cluster() as joint,):
            return Post(skeleton, joint)
        case _:
            return None
