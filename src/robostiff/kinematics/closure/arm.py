"""Closed form for three turns that place a wrist: the arms of industry, and legs RRRS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    body_turned,
    dot,
    quotient,
    rest_of_directions,
    root,
)
from robostiff.kinematics.closure.leg_forms import Cluster, LegForm, Skeleton
from robostiff.kinematics.closure.rod_ends import Circle, aim, circle_of, driven_by_crank
from robostiff.kinematics.turn import turn_about
from robostiff.spatial import cross

_PARALLEL = 1e-9  # sine: rounding
_CROSSED = 1e-3  # sine between axes that turn a third one in all directions they should
# Sine, and part of the length of the arm, below which modes meet: few digits of angles are left.
_MEET = 1e-6


@dataclass(frozen=True)
class Arm(LegForm):
    """Three turns, the last two about parallel axes, and a wrist whose axes meet in one point.

    With W the point of the wrist, seen from a point of the first axis e1, the direction e2 of the
    second axis follows from two angles, as ``e2.e1`` and ``e2.W`` are what they are at zero
    coordinates. Then the second turn is a crank, which carries a rod from the third axis to W; and
    in the wrist the second axis is at given angles to the first and to the third one. Each of these
    has two ways, the signs of the mode: eight postures.

    Notes
    -----
    It is for poses in numbers alone. Records close such a leg by steps, or have its coordinates as
    inputs.
    """

    first: Cluster
    crank: Cluster
    elbow: Cluster  # its point is the nearest to the wrist
    wrist: Cluster  # of three axes, or a spherical joint

    @property
    def leading(self) -> int:
        """Place of the first coordinate."""
        return self.first.places[0]

    @property
    def signs(self) -> tuple[bool, bool, bool]:
        """Which signs of a mode there are."""
        return True, True, not self.wrist.is_ball

    @property
    def turning(self) -> tuple[Cluster, ...]:
        """Joints whose coordinates are angles, from base to platform."""
        return self.first, self.crank, self.elbow, self.wrist

    def closed(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform, at poses."""
        (e1,), (e2,), (e3,) = self.first.axes, self.crank.axes, self.elbow.axes
        hub, W = self.first.point, platform.point(self.wrist.point)
        at_hub = base.point(hub)
        size = root(dot(W - at_hub, W - at_hub))
        to_e2 = float(e2 @ (self.wrist.point - hub))
        aimed = aim(
            base.direction(e1),
            quotient(W - at_hub, size),
            _cosine(e1, e2),
            quotient(to_e2, size) if abs(to_e2) > self.skeleton.rounding else 0,
        )
        shoulder = body_turned(base, self._rests[0], at_hub, e1, e2, aimed.way(self.mode.root))
        drive = driven_by_crank(shoulder, self._circle, W, self.rod @ self.rod, self.mode.first)
        d = quotient(drive.A_to_B, root(dot(drive.A_to_B, drive.A_to_B)))
        fore = body_turned(drive.carrier, self._rests[1], drive.A_now, e3, self.rod, d)
        (a,), (b,), (c,) = (own.places for own in (self.first, self.crank, self.elbow))
        bodies = {0: base, a + 1: shoulder, b + 1: drive.carrier, c + 1: fore}
        bodies[self.wrist.places[-1] + 1] = platform
        if not self.wrist.is_ball:
            e4, e5, e6 = self.wrist.axes
            last = platform.direction(e6)
            bent = aim(fore.direction(e4), last, _cosine(e4, e5), _cosine(e5, e6))
            near = body_turned(fore, self._rests[2], W, e4, e5, bent.way(self.mode.second))
            bodies[self.wrist.places[0] + 1] = near
            bodies[self.wrist.places[1] + 1] = body_turned(near, self._rests[3], W, e5, e6, last)
        return ClosedLeg(bodies, {}, [], [])

    def meeting(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where modes meet at coordinates q (N, size), and where drives can move alone besides.

        Returns
        -------
        meet : (3, N) array of bool
            For each sign of a mode, where both of its ways are the same posture: the triple product
            that has the sign vanishes.
        open_ : (N,) array of bool
            Where W is on the first axis, or the first axis of the wrist is along its last one: the
            pose leaves a sum of coordinates alone.
        """
        (e1,), (e2,), (e3,) = self.first.axes, self.crank.axes, self.elbow.axes
        upper = turn_about(e2, q[:, self.crank.places[0]])
        arm = upper @ (self.elbow.point - self.crank.point)
        fore = np.einsum(
            "nij,njk,k->ni", upper, turn_about(e3, q[:, self.elbow.places[0]]), self.rod
        )
        across = cross(
            np.broadcast_to(e1, arm.shape), self.crank.point - self.first.point + arm + fore
        )
        size = np.linalg.norm(self.elbow.point - self.crank.point) + np.linalg.norm(self.rod)
        found = [across @ e2 / size, cross(arm, fore) @ e2 / size**2]
        open_ = np.linalg.norm(across, axis=-1) <= _MEET * size
        if self.wrist.is_ball:
            found.append(np.ones(len(q)))
        else:
            e4, e5, e6 = self.wrist.axes
            last = turn_about(e5, q[:, self.wrist.places[1]]) @ e6
            bent = cross(np.broadcast_to(e4, last.shape), last)
            found.append(bent @ e5)
            open_ |= np.linalg.norm(bent, axis=-1) <= _MEET
        return np.abs(found) <= _MEET, open_

    @cached_property
    def rod(self) -> np.ndarray:
        """From the third axis to W at zero coordinates (3,) [m]."""
        return self.wrist.point - self.elbow.point

    @cached_property
    def _circle(self) -> Circle:
        """That of the elbow."""
        return circle_of(self.crank, self.elbow.point)

    @cached_property
    def _rests(self) -> list[Rest]:
        """Frames at zero coordinates of what the first, third, fourth and fifth joint carry."""
        pairs = [(self.first.point, self.first.axes[0], self.crank.axes[0])]
        along = self.rod / np.linalg.norm(self.rod)
        pairs.append((self.elbow.point, self.elbow.axes[0], along))
        axes = self.wrist.axes
        pairs += [(self.wrist.point, *axes[i : i + 2]) for i in (0, 1)]
        each = (rest_of_directions(*own)[0] for own in pairs)
        return [Rest(own.R.astype(float), own.p) for own in each]


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    """Of the angle of two unit vectors, exactly 0 at right angles."""
    found = float(a @ b)
    return found if abs(found) > _PARALLEL else 0


def recognise_arm(skeleton: Skeleton) -> Arm | None:
    """The closed form, when the leg is of this kind: six turns, or three and a spherical joint."""
    turns: list[Cluster] = []
    for part in skeleton.parts:
        if not isinstance(part, Cluster):
            return None
        if part.is_ball:
            turns.append(part)
        else:
            pairs = zip(part.axes, part.places, strict=True)
            turns += [Cluster(part.point, (e,), (i,), False, i) for e, i in pairs]
    match turns:
        case (first, crank, elbow, Cluster(is_ball=True) as wrist):
            pass
        case (first, crank, elbow, a, b, c):
            found = _wrist(a, b, c)
            if found is None:
                return None
            wrist = found
        case _:
            return None
    if any(own.is_ball for own in (first, crank, elbow)):
        return None
    (e1,), (e2,), (e3,) = first.axes, crank.axes, elbow.axes
    near = elbow.point + e3 * (e3 @ (wrist.point - elbow.point))
    elbow = Cluster(near, elbow.axes, elbow.places, False, elbow.drawn_at)
    arm = near - crank.point
    shortest = min(np.linalg.norm(np.cross(e2, arm)), np.linalg.norm(wrist.point - near))
    size = np.linalg.norm(arm) + np.linalg.norm(wrist.point - near)
    if (
        np.linalg.norm(np.cross(e1, e2)) < _CROSSED
        or np.linalg.norm(np.cross(e2, e3)) > _PARALLEL
        or shortest <= _CROSSED * size
    ):
        return None
    return Arm(skeleton, first, crank, elbow, wrist)


def _wrist(a: Cluster, b: Cluster, c: Cluster) -> Cluster | None:
    """Three turns as one joint, where their axes meet in a point and none follows its own."""
    if any(own.is_ball for own in (a, b, c)):
        return None
    axes = (a.axes[0], b.axes[0], c.axes[0])
    crossed = [np.cross(axes[i], axes[i + 1]) for i in (0, 1)]
    if min(map(np.linalg.norm, crossed)) < _CROSSED:
        return None
    # W = a + s e_a = b + t e_b, nearly
    apart = b.point - a.point
    n = crossed[0]
    s = np.cross(apart, axes[1]) @ n / (n @ n)
    W = a.point + s * axes[0]
    size = _PARALLEL * (np.linalg.norm(apart) + np.linalg.norm(W - c.point) + 1e-300)
    off = [
        np.linalg.norm(np.cross(e, W - own.point)) for e, own in zip(axes, (a, b, c), strict=True)
    ]
    if max(off) > size:
        return None
    places = (*a.places, *b.places, *c.places)
    return Cluster(W, axes, places, False, b.places[0])
