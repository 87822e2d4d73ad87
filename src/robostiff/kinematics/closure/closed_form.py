"""Legs in closed form: what kinds of them share, and their coordinates at poses."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from robostiff.kinematics.closure.assembly import RootSigns
from robostiff.kinematics.closure.body import LegBody, Rest, direction_across
from robostiff.kinematics.closure.closed_leg import ClosedLeg
from robostiff.kinematics.closure.rod_ends import RodJoints
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
class RodForm(LegForm):
    """A leg with a rod between two joints."""

    joints: RodJoints  # the rod, and the joints at its ends

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""
        return (True, *self.joints.two_ways)

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
