"""Legs in closed form: what they have in common, and a post with one joint."""

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
    body_of_directions,
    body_turned,
    constant_cosine,
    direction_across,
    dot,
    rest_of_directions,
    tidied,
)
from robostiff.kinematics.closure.skeleton import Cluster, Skeleton
from robostiff.record import Entry
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
