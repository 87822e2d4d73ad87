"""A rod of a leg: what drives it, the two joints at its ends, and its gaps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.kinematics.closure.assembly import RootSigns
from robostiff.kinematics.closure.body import (
    ClosedLeg,
    LegBody,
    Rest,
    body_of_directions,
    body_turned,
    constant_cosine,
    cross,
    dot,
    frame,
    positive_part,
    quotient,
    rest_of_directions,
    root,
    spun,
    tidied,
    tidied_point,
)
from robostiff.kinematics.closure.skeleton import Cluster, Slide
from robostiff.kinematics.turn import turn_by_vector_of_entries
from robostiff.record import Entry, is_zero, least, square_root
from robostiff.spatial import cross as cross_of_entries

# Square of the sum of two unit vectors that counts as none.
_OPPOSITE = 1e-12
#: 1 or -1, for all poses or one by one.
Sign = int | np.ndarray


@dataclass(frozen=True)
class Aim:
    """The two unit vectors b = level +- across at given angles to two directions a and d."""

    # (3,) or (3, N): the last is a x d; the first is 0 where b is at right angles to both
    level: Any
    across: np.ndarray
    normal: np.ndarray
    square: Any  # |a x d|^2
    gap: Any  # 0 where such vectors exist, else of the size of the square of what is missing

    def way(self, sign: Sign) -> np.ndarray:
        """That with ``b.(a x d)`` of a sign, 1 or -1."""
        return self.level + self.across * sign


def aim(a: np.ndarray, d: np.ndarray, to_a: Any, to_d: Any) -> Aim:
    """Unit vectors b with b.a = to_a and b.d = to_d, b = x a + y d +- z (a x d).

    With g = a.d and D = 1 - g^2::

        x = (to_a - g to_d) / D,  y = (to_d - g to_a) / D,  z = sqrt((1 - x to_a - y to_d) / D)

    At right angles to both, b = +-(a x d) / |a x d|. Where the angles cannot be had, z = 0.
    a and d are unit vectors, not parallel; `to_a` and `to_d` cosines, of poses perhaps (N,).
    """
    normal = cross(a, d)
    square = dot(normal, normal)
    if not isinstance(to_d, np.ndarray) and is_zero(to_a) and is_zero(to_d):
        return Aim(0, quotient(normal, root(square)), normal, square, 0)
    g = dot(a, d)
    x, y = quotient(to_a - g * to_d, square), quotient(to_d - g * to_a, square)
    left = 1 - x * to_a - y * to_d
    across = normal * root(quotient(positive_part(left), square))
    return Aim(a * x + d * y, across, normal, square, lack_of(left))


def lack_of(value: Any) -> Any:
    """What an entry lacks to be positive, at the samples and everywhere else; nothing of poses."""
    return 0 if isinstance(value, np.ndarray) else -least(value, 0)


def shortest_turn_of(
    start: np.ndarray, sides: tuple[np.ndarray, ...], end: np.ndarray
) -> list[np.ndarray]:
    """What directions across `start` become when the shortest turn brings it to `end`.

    ``m - (m.end) / (1 + start.end) (start + end)`` for each; regular unless the two unit vectors
    are opposite.
    """
    both = start + end
    if both.ndim == 2:
        m, square = sides[0], dot(both, both)
        turned = m - both * quotient(2.0 * dot(m, end), square)
        opposite = square < _OPPOSITE
        if np.any(opposite):  # half a turn about the first side
            still = m - end * dot(m, end)
            turned = np.where(opposite, quotient(still, np.sqrt(dot(still, still))), turned)
        return [turned, cross(end, turned)]
    part = 1 / (1 + start @ end)
    return [m - both * ((m @ end) * part) for m in sides]


def coordinate_axis_along(d: np.ndarray) -> np.ndarray:
    """The coordinate axis (3,), forward or backward, from which a direction is never far."""
    worst = [
        (float(np.min(np.asarray(sign * x.sample if isinstance(x, Entry) else sign * x))), i, sign)
        for i, x in enumerate(tidied(d))
        for sign in (1, -1)
    ]
    _, i, sign = max(worst)
    return sign * np.eye(3, dtype=int)[i]


@dataclass(frozen=True)
class Driven:
    """Point and axes that a drive carries."""

    carrier: LegBody  # carriage or crank
    A_now: np.ndarray  # (3,): where the near end of the rod is [m]
    A_to_B: np.ndarray  # (3,): the rod [m]
    slide: Any  # coordinate of a slide [m]
    # 0 where the rod reaches, else what lacks of the square of its length, as a part of it
    out_of_reach: Any
    # Digits that the drive's coordinate loses; infinite for a crank that turns about the far end of
    # its rod, which leaves it undetermined
    loss: Any


def driven_by_slide(
    base: LegBody, slide: Slide, A: np.ndarray, B_now: np.ndarray, square: Any, sign: Sign
) -> Driven:
    """Slide with |B - A - s e| = l: s = e.(B - A) +- sqrt(l^2 - |across|^2).

    The near end A of the rod is given at zero coordinates, the far end B in the world, and l^2
    [m^2].
    """
    e, start = base.direction(slide.axis), base.point(A)
    to_B = B_now - start
    along = dot(e, to_B)
    across = to_B - e * along
    left = square - dot(across, across)
    half = root(positive_part(left)) * sign
    s = along + half
    A_now = start + e * s
    return Driven(base.at(A, A_now), A_now, across - e * half, s, lack_of(left) / square, 0)


@dataclass(frozen=True)
class Circle:
    """The circle of the near end of a rod about the axis of its crank, at zero coordinates."""

    rest: Rest  # its centre; axes along the arm, across it, and along that of the crank
    radius: Any  # [m]


def circle_of(crank: Cluster, A: np.ndarray) -> Circle:
    """The circle on which a crank of one axis carries a point."""
    e0 = crank.axes[0]
    arm = A - crank.point
    level = e0 * (e0 @ arm)
    radius = square_root((arm - level) @ (arm - level))
    m0 = tidied((arm - level) / radius)
    R_zero = np.stack([m0, cross(e0, m0), e0], axis=-1)
    hub = tidied_point(crank.point + level)
    if e0.dtype != object:
        R_zero, hub = R_zero.astype(float), hub.astype(float)
    return Circle(Rest(R_zero, hub), radius)


def driven_by_crank(
    base: LegBody, circle: Circle, B_now: np.ndarray, square: Any, sign: Sign
) -> Driven:
    """Crank with |B - A(s)| = l, from x cos s + y sin s = c, given by cosine and sine.

    x and y are the components of B along the arm at zero and across it, r the radius of A, and ``c
    = (|B|^2 + r^2 - l^2) / 2 r``, all seen from the centre of the circle of A.
    """
    rest, radius = circle.rest, circle.radius
    m, n, e = (base.direction(axis) for axis in rest.R.T)
    centre = base.point(rest.p)
    to_B = B_now - centre
    x, y = dot(to_B, m), dot(to_B, n)
    height = dot(to_B, e)
    if not base.is_at_poses:
        (height,) = tidied_point(np.array([height], dtype=object))
    size = x * x + y * y
    c = (size + (height * height + (radius * radius - square))) / (2 * radius)
    if base.is_at_poses:  # out of reach, as far as it goes
        c = np.clip(c, -np.sqrt(size), np.sqrt(size))
    left = size - c * c
    half = root(positive_part(left)) * sign
    cosine, sine = quotient(x * c - y * half, size), quotient(y * c + x * half, size)
    if base.is_at_poses:  # about the far end of its rod it may turn, and stays
        cosine = np.where(size == 0, 1.0, cosine)
    out = m * cosine + n * sine
    A_now = centre + out * radius
    now = frame(out, n * cosine - m * sine, e)
    carrier = LegBody(rest, now, centre)
    return Driven(
        carrier, A_now, B_now - A_now, None, lack_of(left) / square, quotient(square, size)
    )


def fits(first: Cluster, second: Cluster, along: np.ndarray) -> bool:
    """Whether the two joints can be solved one after the other for a rod `along` a direction."""
    if first.is_ball:
        return True
    pointing = first.axes[-1]
    return float(np.linalg.norm(np.cross(pointing, along))) > 1e-6 and (
        second.is_ball or len(second.axes) <= 2
    )


@dataclass(frozen=True)
class RodJoints:
    """A rod from joint A to joint B at zero coordinates."""

    A: Cluster
    B: Cluster
    along: np.ndarray  # (3,): unit vector from A to B
    spin: int | None  # place of a turn about the rod itself
    home: np.ndarray  # (size,): leg coordinates in the home configuration
    side: np.ndarray  # (3,): a direction across the rod; that of a beam's section keeps it short
    # Whether the turn about itself matters of a rod between two spherical joints
    spin_matters: bool = True
    _rests: dict[tuple[bytes, bytes], Rest] = field(default_factory=dict, compare=False, repr=False)

    @property
    def turned_by_second(self) -> bool:
        """Whether the joint at the far end turns the rod about itself."""
        return not self.B.is_ball and (self.spin is not None or self.A.is_ball)

    @cached_property
    def cosines_at_A(self) -> tuple[Any, Any]:
        """Of the angles of the second axis at A to the first and to the rod."""
        a0, b0 = self.A.axes
        return constant_cosine(a0, b0), constant_cosine(b0, self.along)

    @cached_property
    def cosines_at_B(self) -> tuple[Any, Any]:
        """Of the angles of the first axis at B to the rod and to the second."""
        b0, e0 = self.B.axes
        return constant_cosine(b0, self.along), constant_cosine(b0, e0)

    @cached_property
    def ball_rest(self) -> Rest:
        """Frame of a rod that a spherical joint carries: the rod, and two directions across."""
        axes = (self.along, self.side, cross_of_entries(self.along, self.side))
        return Rest(np.stack(axes, axis=-1), self.A.point)

    @cached_property
    def home_of_ball(self) -> np.ndarray:
        """Rotation of the spherical joint at A in the home configuration (3, 3)."""
        axes = np.stack(self.A.axes, axis=-1)
        home = np.array([self.home[place] for place in self.A.places], dtype=object)
        if all(map(is_zero, home)):
            return np.eye(3, dtype=int)
        return axes @ turn_by_vector_of_entries(home) @ axes.T

    def rest(self, axis: np.ndarray, target: np.ndarray) -> Rest:
        """Frame of a body that an axis turns, its direction beside the axis, of numbers."""
        key = axis.tobytes(), target.tobytes()
        if key not in self._rests:
            found, _ = rest_of_directions(np.zeros(3), axis, target)
            self._rests[key] = Rest(found.R.astype(float), found.p)
        return self._rests[key]


@dataclass(frozen=True)
class RodEnds:
    """A rod whose ends are known."""

    joints: RodJoints
    # What carries the joints
    near: LegBody
    platform: LegBody
    d: np.ndarray  # (3,) or (3, N): unit vector from A to B now
    # (3,) or (3, N): places of the joints [m]
    A_now: np.ndarray
    B_now: np.ndarray
    mode: RootSigns  # of its assembly


def placed_rod(ends: RodEnds) -> ClosedLeg:
    """Turn a rod so that it points from A to B and its joints meet the platform."""
    joints = ends.joints
    A, B, spin = joints.A, joints.B, joints.spin
    bodies: dict[int, LegBody] = {}
    rod, gimbal, misses, lacks = _at_first(ends)
    if gimbal is not None:
        bodies[A.places[0] + 1] = gimbal
    if rod.is_at_poses:  # out of reach, the direction that it reaches
        ends = replace(ends, d=rod.direction(joints.along))
    far, more_misses, more_lacks = _at_second(ends, rod)
    if A.is_ball:  # the ball takes the spin that the joint at B leaves
        rod = _spun(ends, far, -1) if not B.is_ball else far
    if B.is_ball:
        far = _spun(ends, rod, 1)
    bodies[A.places[-1] + 1] = rod
    if spin is not None:
        bodies[spin + 1] = far.at(B.point, ends.B_now)
    bodies[B.places[0]] = far.at(B.point, ends.B_now)
    if len(B.axes) == 2:
        first, last = far.direction(B.axes[0]), ends.platform.direction(B.axes[1])
        bodies[B.places[0] + 1] = _carried(
            far,
            (B.axes[0], first),
            (B.axes[1], last),
            (B.point, ends.B_now),
            joints,
            target_first=True,
        )
    bodies[B.places[-1] + 1] = ends.platform
    ball_axes: dict[int, np.ndarray] = {}
    for cluster, body in ((A, rod), (B, far)):
        if cluster.is_ball:
            ball_axes |= {p: body.R[:, i] for i, p in enumerate(cluster.places)}
    return ClosedLeg(bodies, ball_axes, misses + more_misses, lacks + more_lacks)


Pair = tuple[np.ndarray, np.ndarray]


def _carried(
    before: LegBody, axis: Pair, target: Pair, point: Pair, joints: RodJoints, *, target_first: bool
) -> LegBody:
    """The body after an axis that brings a direction to its target, each at zero and now.

    Over poses the axis stays where `before` has it, so that out of reach the direction comes as
    near as it can. A record takes one of the two as its first axis, which keeps it short.
    """
    if before.is_at_poses:
        rest = joints.rest(axis[0], target[0])
        return body_turned(before, rest.at(point[0]), point[1], axis[0], *target)
    (u0, u), (v0, v) = (target, axis) if target_first else (axis, target)
    return body_of_directions((point[0], u0, v0), (point[1], u, v))


def _at_first(ends: RodEnds) -> tuple[LegBody, LegBody | None, list[Any], list[Any]]:
    """The rod as joint A points it, what lies between two axes, misses and lacks."""
    A = ends.joints.A
    if A.is_ball:
        return _shortest(ends), None, [], []
    if len(A.axes) == 1:
        a = ends.near.direction(A.axes[0])
        misses = _missed_angle(ends, A.axes[0], a)
        return _at_A(ends, ends.near, (A.axes[0], a), (ends.joints.along, ends.d)), None, misses, []
    a0, b0 = A.axes
    a = ends.near.direction(a0)
    found = aim(a, ends.d, *ends.joints.cosines_at_A)
    b = b0, found.way(ends.mode.first)
    gimbal = _at_A(ends, ends.near, (a0, a), b)
    return _at_A(ends, gimbal, b, (ends.joints.along, ends.d)), gimbal, [], [found.gap]


def _at_second(ends: RodEnds, rod: LegBody) -> tuple[LegBody, list[Any], list[Any]]:
    """The rod at joint B, which may turn it about itself, misses and lacks."""
    B = ends.joints.B
    turned = ends.joints.turned_by_second
    if B.is_ball or (rod.is_at_poses and not turned):
        return rod, [], []
    e = ends.platform.direction(B.axes[-1])
    if not turned:
        on_rod = rod.direction(B.axes[0])
        off = [on_rod @ e - constant_cosine(*B.axes)] if len(B.axes) == 2 else on_rod - e
        return rod, [_square(x) for x in off], []
    if len(B.axes) == 1:
        misses = _missed_angle(ends, B.axes[0], e)
        return _about_rod(ends, rod, (B.axes[0], e)), misses, []
    found = aim(ends.d, e, *ends.joints.cosines_at_B)
    b = found.way(ends.mode.second)
    return _about_rod(ends, rod, (B.axes[0], b)), [], [found.gap]


def _at_A(ends: RodEnds, before: LegBody, axis: Pair, target: Pair) -> LegBody:
    """What an axis at joint A carries."""
    point = ends.joints.A.point, ends.A_now
    return _carried(before, axis, target, point, ends.joints, target_first=True)


def _about_rod(ends: RodEnds, rod: LegBody, target: Pair) -> LegBody:
    """The rod turned about itself, so that an axis at joint B meets its target."""
    joints = ends.joints
    if rod.is_at_poses and abs(constant_cosine(joints.along, target[0])) == 1:
        return rod  # it is on the rod and meets what it can
    point = joints.A.point, ends.A_now
    return _carried(rod, (joints.along, ends.d), target, point, joints, target_first=False)


def _missed_angle(ends: RodEnds, axis: np.ndarray, now: np.ndarray) -> list[Any]:
    """How far an axis is from its angle to the rod."""
    if ends.near.is_at_poses:
        return []
    return [_square(now @ ends.d - constant_cosine(axis, ends.joints.along))]


def _shortest(ends: RodEnds) -> LegBody:
    """The rod after the shortest turn from home, or from a coordinate axis nearby."""
    joints = ends.joints
    rest = joints.ball_rest
    if joints.spin_matters or joints.turned_by_second:
        R_home = joints.home_of_ball
        if ends.near.is_at_poses:
            R_home = R_home.astype(float)
        start, *sides = (ends.near.direction(v @ R_home.T) for v in rest.R.T)
    else:
        start = coordinate_axis_along(ends.d)
        k = int(np.flatnonzero(start)[0])
        m = np.eye(3, dtype=int)[(k + 1) % 3]
        sides = [m, np.cross(start, m)]
    turned = shortest_turn_of(start, tuple(sides), ends.d)
    return LegBody(rest, frame(ends.d, *turned), ends.A_now)


def _spun(ends: RodEnds, rod: LegBody, sign: int) -> LegBody:
    """The rod after a turn about itself by the home angle of its spin, or before that turn."""
    spin = ends.joints.spin
    angle = 0 if spin is None else ends.joints.home[spin] * sign
    return rod if is_zero(angle) else replace(rod, R=spun(rod.R, ends.d, angle))


def _square(x: Any) -> Any:
    x = tidied(np.array([x], dtype=object))[0]
    return x * x
