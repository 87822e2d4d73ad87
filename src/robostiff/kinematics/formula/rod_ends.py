"""The two joints at the ends of a rod on entries: the turned rod, and its gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.kinematics.closure.assembly import Mode
from robostiff.kinematics.closure.skeleton import Cluster
from robostiff.kinematics.formula.body import LegBody, body_of_directions, constant_cosine, tidied
from robostiff.kinematics.formula.drive import aim, coordinate_axis_along, shortest_turn_of
from robostiff.kinematics.turn import Turn, turn_by_vector_of_entries
from robostiff.record import is_zero
from robostiff.spatial import cross


@dataclass(frozen=True)
class RodEnds:
    """A rod from joint A to joint B, whose places are known.

    Attributes
    ----------
    near, platform : LegBody
        What carries the joints.
    A, B : Cluster
    along : (3,) array
        Unit vector from A to B at zero coordinates.
    d : (3,) array
        The same now, in the world.
    A_now, B_now : (3,) arrays
        Places of the joints [m].
    spin : int or None
        Place of a turn about the rod itself.
    home : (size,) array
        Leg coordinates in the home configuration.
    side : (3,) array
        A direction across the rod at zero coordinates; that of a beam's section keeps it short.
    mode : Mode
        Of its assembly.
    spin_matters : bool
        Whether the turn about itself matters of a rod between two spherical joints.
    """

    near: LegBody
    platform: LegBody
    A: Cluster
    B: Cluster
    along: np.ndarray
    d: np.ndarray
    A_now: np.ndarray
    B_now: np.ndarray
    spin: int | None
    home: np.ndarray
    side: np.ndarray
    mode: Mode
    spin_matters: bool

    @property
    def turned_by_second(self) -> bool:
        """Whether the joint at the far end turns the rod about itself."""
        return not self.B.is_ball and (self.spin is not None or self.A.is_ball)


@dataclass(frozen=True)
class PlacedRod:
    """Bodies along a rod, and what keeps its joints from closing.

    Attributes
    ----------
    bodies : dict of int to LegBody
        A body begins after that many elementary joints.
    ball_axes : dict of int to (3,) array
    misses : list of Entry or number
        Squares that vanish when the leg closes.
    out_of_reach : list of Entry or number
        Positive where the axes cannot reach the directions.
    """

    bodies: dict[int, LegBody]
    ball_axes: dict[int, np.ndarray]
    misses: list[Any]
    out_of_reach: list[Any]


def placed_rod(ends: RodEnds) -> PlacedRod:
    """Turn a rod so that it points from A to B and its joints meet the platform."""
    A, B = ends.A, ends.B
    bodies: dict[int, LegBody] = {}
    rod, gimbal, misses, lacks = _at_first(ends)
    if gimbal is not None:
        bodies[A.places[0] + 1] = gimbal
    far, more_misses, more_lacks = _at_second(ends, rod)
    if A.is_ball:  # what spin the joint at B asks for is the ball's
        rod = _spun(ends, far, -1) if not B.is_ball else far
    if B.is_ball:
        far = _spun(ends, rod, 1)
    bodies[A.places[-1] + 1] = rod
    if ends.spin is not None:
        bodies[ends.spin + 1] = far.at(B.point, ends.B_now)
    bodies[B.places[0]] = far.at(B.point, ends.B_now)
    if len(B.axes) == 2:
        first, last = far.direction(B.axes[0]), ends.platform.direction(B.axes[1])
        zero, now = (B.point, B.axes[1], B.axes[0]), (ends.B_now, last, first)
        bodies[B.places[0] + 1] = body_of_directions(zero, now)
    bodies[B.places[-1] + 1] = ends.platform
    ball_axes: dict[int, np.ndarray] = {}
    for cluster, body in ((A, rod), (B, far)):
        if cluster.is_ball:
            ball_axes |= {p: body.R[:, i] for i, p in enumerate(cluster.places)}
    return PlacedRod(bodies, ball_axes, misses + more_misses, lacks + more_lacks)


def _at_first(ends: RodEnds) -> tuple[LegBody, LegBody | None, list[Any], list[Any]]:
    """The rod as joint A points it, what lies between two axes, misses and lacks."""
    A = ends.A
    if A.is_ball:
        return _shortest(ends), None, [], []
    if len(A.axes) == 1:
        a = ends.near.direction(A.axes[0])
        rod, misses = _about_one(ends, A.axes[0], a)
        return rod, None, misses, []
    gimbal, rod, lack = _pointed(ends)
    return rod, gimbal, [], [lack]


def _at_second(ends: RodEnds, rod: LegBody) -> tuple[LegBody, list[Any], list[Any]]:
    """The rod at joint B, which may turn it about itself, misses and lacks."""
    B = ends.B
    if B.is_ball:
        return rod, [], []
    if not ends.turned_by_second:
        return rod, _missed(ends, rod), []
    e = ends.platform.direction(B.axes[-1])
    if len(B.axes) == 1:
        far, misses = _about_one(ends, B.axes[0], e)
        return far, misses, []
    far, lack = _taken_up(ends, e)
    return far, [], [lack]


def _about_one(ends: RodEnds, axis: np.ndarray, now: np.ndarray) -> tuple[LegBody, list[Any]]:
    """The rod that one axis carries, and how far the axis is from its angle to the rod."""
    missed = _square(now @ ends.d - constant_cosine(axis, ends.along))
    return _body(ends, (ends.along, ends.d), (axis, now)), [missed]


def _pointed(ends: RodEnds) -> tuple[LegBody, LegBody, Any]:
    """What lies between two axes, the rod that they point, and what they lack to do so."""
    a0, b0 = ends.A.axes
    a = ends.near.direction(a0)
    to_a, to_d = constant_cosine(a0, b0), constant_cosine(b0, ends.along)
    found = aim(a, ends.d, to_a, to_d)

    b = found.way(ends.mode.first)
    gimbal = _body(ends, (b0, b), (a0, a))
    return gimbal, _body(ends, (ends.along, ends.d), (b0, b)), found.gap


def _taken_up(ends: RodEnds, e: np.ndarray) -> tuple[LegBody, Any]:
    """The rod as the two axes at its far end turn it about itself, and what they lack to do so."""
    b0, e0 = ends.B.axes
    to_d, to_e = constant_cosine(b0, ends.along), constant_cosine(b0, e0)
    found = aim(ends.d, e, to_d, to_e)
    b = found.way(ends.mode.second)
    return _body(ends, (ends.along, ends.d), (b0, b)), found.gap


def _missed(ends: RodEnds, rod: LegBody) -> list[Any]:
    """Squares that vanish where the joint at the far end fits both rod and platform."""
    B = ends.B
    e = ends.platform.direction(B.axes[-1])
    on_rod = rod.direction(B.axes[0])
    if len(B.axes) == 2:
        return [_square(on_rod @ e - constant_cosine(*B.axes))]
    return [_square(x) for x in on_rod - e]


def _shortest(ends: RodEnds) -> LegBody:
    """The rod after the shortest turn from home, or from a coordinate axis nearby."""
    sides0 = (ends.side, cross(ends.along, ends.side))
    if ends.spin_matters or ends.turned_by_second:
        R_home = _home_of_ball(ends)
        start, *sides = (ends.near.direction(v @ R_home.T) for v in (ends.along, *sides0))
    else:
        start = coordinate_axis_along(ends.d)
        k = int(np.flatnonzero(start)[0])
        m = np.eye(3, dtype=int)[(k + 1) % 3]
        sides = [m, np.cross(start, m)]
    turned = shortest_turn_of(start, tuple(sides), ends.d)
    zero = np.stack([ends.along, *sides0], axis=-1)
    now = np.stack([ends.d, *turned], axis=-1)
    return LegBody(zero, ends.A.point, now, ends.A_now)


def _home_of_ball(ends: RodEnds) -> np.ndarray:
    """Rotation of the spherical joint at A in the home configuration (3, 3)."""
    axes = np.stack(ends.A.axes, axis=-1)
    home = np.array([ends.home[place] for place in ends.A.places], dtype=object)
    if all(map(is_zero, home)):
        return np.eye(3, dtype=int)
    return axes @ turn_by_vector_of_entries(home) @ axes.T


def _spun(ends: RodEnds, rod: LegBody, sign: int) -> LegBody:
    """The rod after a turn about itself by the home angle of its spin, or before that turn."""
    angle = 0 if ends.spin is None else ends.home[ends.spin] * sign
    if is_zero(angle):
        return rod
    return replace(rod, R=Turn.by(angle).about(ends.d) @ rod.R)


def _body(
    ends: RodEnds,
    first: tuple[np.ndarray, np.ndarray],
    second: tuple[np.ndarray, np.ndarray],
) -> LegBody:
    """A body at A from two directions, each at zero coordinates and now."""
    (u0, u), (v0, v) = first, second
    return body_of_directions((ends.A.point, u0, v0), (ends.A_now, u, v))


def _square(x: Any) -> Any:
    x = tidied(np.array([x], dtype=object))[0]
    return x * x
