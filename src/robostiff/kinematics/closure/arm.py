"""Closed form for three turns that place a wrist: the arms of industry, and legs RRRS."""

from __future__ import annotations

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    aim,
    body_after_turn,
    constant_cosine,
    dot,
    quotient,
    rest_of_directions,
)
from robostiff.kinematics.closure.leg_forms import Cluster, LegForm, RootSigns, Skeleton
from robostiff.kinematics.closure.rods import Rod, rod_between
from robostiff.kinematics.turn import turn_about
from robostiff.record import square_root
from robostiff.spatial import cross

_PARALLEL = 1e-9  # sine: rounding
_CROSSED = 1e-3  # sine between axes that turn a third one in all directions they should
# Sine, and part of the length of the arm, below which modes meet: few digits of angles are left.
_MEET = 1e-6


@frozen
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
    # From the crank on: A is the elbow, its point the nearest to the wrist; B the wrist, of three
    # axes or a spherical joint
    rod: Rod

    def leg_between(self, base: LegBody, platform: LegBody) -> ClosedLeg:
        """The leg between its base and the platform, at poses."""
        (e1, e2), wrist = self._axes, self.rod.B.point
        W, hub = platform.point(wrist), base.point(self.first.point)
        size = square_root(dot(W - hub, W - hub))
        to_e2 = float(e2 @ (wrist - self.first.point))
        aimed = aim(
            base.direction(e1),
            quotient(W - hub, size),
            constant_cosine(e1, e2),
            quotient(to_e2, size) if abs(to_e2) > self.skeleton.rounding else 0,
        )
        rest, _ = rest_of_directions(self.first.point, e1, e2)
        rest = Rest(rest.R.astype(float), rest.p)
        shoulder = body_after_turn(base, rest, hub, e1, e2, aimed.way(self.mode.root))
        mode = RootSigns(self.mode.first, 1, self.mode.second)
        found = self.rod.in_mode(mode).leg_between(shoulder, platform)
        return replace(found, bodies={**found.bodies, 0: base, self.leading + 1: shoulder})

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
        (e1, e2), crank, elbow, wrist = self._axes, *self.rod.turning
        upper = turn_about(e2, q[:, crank.places[0]])
        to_elbow, to_wrist = elbow.point - crank.point, wrist.point - elbow.point
        arm = upper @ to_elbow
        bend = turn_about(elbow.axes[0], q[:, elbow.places[0]])
        fore = np.einsum("nij,njk,k->ni", upper, bend, to_wrist)
        across = cross(np.broadcast_to(e1, arm.shape), crank.point - self.first.point + arm + fore)
        size = np.linalg.norm(to_elbow) + np.linalg.norm(to_wrist)
        found = [across @ e2 / size, cross(arm, fore) @ e2 / size**2]
        open_ = np.linalg.norm(across, axis=-1) <= _MEET * size
        if wrist.is_ball:
            found.append(np.ones(len(q)))
        else:
            e4, e5, e6 = wrist.axes
            last = turn_about(e5, q[:, wrist.places[1]]) @ e6
            bent = cross(np.broadcast_to(e4, last.shape), last)
            found.append(bent @ e5)
            open_ |= np.linalg.norm(bent, axis=-1) <= _MEET
        return np.abs(found) <= _MEET, open_

    @property
    def _axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of the first and the second joint."""
        crank, *_ = self.rod.turning
        return self.first.axes[0], crank.axes[0]


def arm_of(skeleton: Skeleton) -> Arm | None:
    """The closed form of six turns, or of three and a spherical joint, where it is one."""
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
        case (first, crank, elbow, a, b, c) if found := _wrist(a, b, c):
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
    rod, signs = rod_between(skeleton, crank, elbow, wrist), (True, True, not wrist.is_ball)
    return Arm(skeleton, first.places[0], signs, (first, *rod.turning), first, rod)


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
    pairs = zip(axes, (a, b, c), strict=True)
    if max(np.linalg.norm(np.cross(e, W - own.point)) for e, own in pairs) > size:
        return None
    places = (*a.places, *b.places, *c.places)
    return Cluster(W, axes, places, False, b.places[0])
