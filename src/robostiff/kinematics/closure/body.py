"""Rigid bodies of a leg, at zero coordinates and where they are now; aims, and the closed leg.

Vectors are of recorded entries, arrays (3,) and (3, 3) of objects, or of numbers with poses in the
last axis, arrays (3, N) and (3, 3, N) of floats. Sums and products of components are NumPy's for
both.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.frozen import field, frozen
from robostiff.model import TelescopicBeam
from robostiff.record import (
    Entry,
    arc_tangent,
    cosine,
    is_one,
    is_zero,
    least,
    most_size,
    shortened,
    sine,
    square_root,
)
from robostiff.record.record import is_exact

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def dot(a: np.ndarray, b: np.ndarray) -> Any:
    """Scalar product of two vectors, an entry or (N,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of two vectors."""
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


def frame(*columns: np.ndarray) -> np.ndarray:
    """Three vectors as the columns of a matrix."""
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def times(R: np.ndarray, local: np.ndarray) -> np.ndarray:
    """R v for a vector v (3,), zeros of which cost nothing."""
    parts = [R[:, i] if is_one(x) else R[:, i] * x for i, x in enumerate(local) if not is_zero(x)]
    return sum(parts[1:], parts[0]) if parts else R[:, 0] * 0


def spun(R: np.ndarray, axis: np.ndarray, angle: Any) -> np.ndarray:
    """R after a turn about a unit vector."""
    c, s = cosine(angle), sine(angle)
    columns = (R[:, i] for i in range(3))
    return frame(*(v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c)) for v in columns))


def quotient(a: Any, b: Any) -> Any:
    """A / b; at poses where b is 0, a itself."""
    if isinstance(b, np.ndarray):
        return a / np.where(b == 0, 1.0, b)
    value = a / b
    of_floats = isinstance(value, np.ndarray) and value.dtype != object
    return value if of_floats else shortened(value)


def positive_part(value: Any) -> Any:
    """The larger one of a value and 0."""
    if isinstance(value, np.ndarray):
        return np.maximum(value, 0.0)
    return -least(-value, 0) if isinstance(value, Entry) else max(value, 0)


#: Of a cosine: what a few operations leave of an exact zero.
ROUNDING = 4e-15
# Sine below which a direction is along an axis: nothing turns it about that.
_ALONG = 1e-15


def tidy_numbers(values: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """The same entries as objects; those that are 0 or +-1 up to rounding as integers.

    Numbers count as zero against a scale.
    """
    out = np.empty(values.size, dtype=object)
    for place, value in enumerate(values.ravel().tolist()):
        if isinstance(value, Entry):
            own = value.record.simplify(value, scale)
        elif is_exact(value):
            own = int(value) if value.is_Integer and -1 <= value.p <= 1 else value
        elif abs(value) <= ROUNDING * scale:
            own = 0
        elif abs(abs(value) - 1) <= ROUNDING:
            own = 1 if value > 0 else -1
        else:
            own = float(value)
        out[place] = own
    return out.reshape(values.shape)


def tidy_point(p: np.ndarray) -> np.ndarray:
    """The same point; components of the size of rounding beside the largest become 0."""
    return tidy_numbers(p, max(most_size(x) for x in p))


@frozen
class Rest:
    """A frame of a body while all coordinates are zero."""

    # (3, 3) and (3,): in the leg's base frame
    R: np.ndarray
    p: np.ndarray

    def direction(self, e: np.ndarray) -> np.ndarray:
        """A direction, or several as columns, seen from the frame; for records."""
        return tidy_numbers(self.R.T @ e)

    def point(self, x: np.ndarray) -> np.ndarray:
        """A point seen from the frame; for records."""
        return tidy_numbers(self.R.T @ (x - self.p), max(most_size(c) for c in (*x, *self.p)))


@frozen
class LegBody:
    """A frame of a body at zero coordinates and now; all else of the body moves along."""

    rest: Rest  # at zero coordinates
    # (3, 3) and (3,) of entries, or (3, 3, N) and (3, N): now, in the world
    R: np.ndarray
    p: np.ndarray

    @property
    def is_at_poses(self) -> bool:
        """Whether it is given by numbers at poses, not by recorded entries."""
        return self.R.ndim == 3

    def point(self, x: np.ndarray) -> np.ndarray:
        """Where a point of the body is that was at x."""
        if self.is_at_poses:
            return self.p + self.direction(x - self.rest.p)
        return self.p + times(self.R, self.rest.point(x))

    def direction(self, e: np.ndarray) -> np.ndarray:
        """The present direction of the body that was e."""
        if self.is_at_poses:
            return np.einsum("ijn,j->in", self.R, self.rest.R.T @ e)
        return times(self.R, self.rest.direction(e))

    def axes(self, R: np.ndarray) -> np.ndarray:
        """The present axes of the body that were the columns of R."""
        return self.R @ self.rest.direction(R)

    def at(self, x: np.ndarray, p: np.ndarray) -> LegBody:
        """A body of the same orientation, whose point x is at p."""
        return LegBody(Rest(self.rest.R, x), self.R, p)


def rest_of_directions(x: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[Rest, Any]:
    """The frame at a point whose first axis is u and whose second is beside v, and u.v."""
    c = constant_cosine(u, v)
    return Rest(_axes(u, v, c), x), c


def body_of_directions(
    zero: tuple[np.ndarray, np.ndarray, np.ndarray], now: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> LegBody:
    """The body that carries a point and two directions at a constant angle.

    These are (point, u, v), at zero coordinates and now, in the world.
    """
    p, u, v = now
    rest, c = rest_of_directions(*zero)
    return LegBody(rest, _axes(u, v, c), p)


def body_after_turn(
    before: LegBody,
    rest: Rest,
    p: np.ndarray,
    axis: np.ndarray,
    target: np.ndarray,
    end: np.ndarray,
) -> LegBody:
    """The body after a joint that brings a direction nearest to another, at poses.

    The joint is carried by `before`, about an axis that is given at zero coordinates as its
    direction `target` is, which is wanted at `end` (3, N). `rest` is the frame of the body: axis,
    then the part of the direction across it; p is its origin. The turn is zero where neither of the
    directions leaves its axis.
    """
    e = before.direction(axis)
    across = end - e * dot(e, end)
    size = np.sqrt(dot(across, across))
    along = size < _ALONG
    if along.any():
        home = before.direction(target)
        home = home - e * dot(e, home)
        across = np.where(along, home, across)
        size = np.where(along, np.sqrt(dot(home, home)), size)
    v = across / size
    return LegBody(rest, frame(e, v, cross(e, v)), p)


def constant_cosine(u: np.ndarray, v: np.ndarray) -> Any:
    """Cosine of the angle of two unit vectors that keep it, 0 where they are perpendicular."""
    return tidy_numbers(np.array([u @ v], dtype=object))[0]


def direction_across(axis: np.ndarray) -> np.ndarray:
    """Some unit vector across an axis."""
    start = np.eye(3, dtype=int)[int(np.argmin([most_size(x) for x in axis]))]
    v = start - axis * (start @ axis)
    return tidy_numbers(v / square_root(v @ v))


def _axes(u: np.ndarray, v: np.ndarray, c: Any) -> np.ndarray:
    """Columns u, the part of v across u made unit, and their vector product."""
    if not is_zero(c):
        v = (v - u * c) / square_root(1 - c * c)
    return frame(u, v, cross(u, v))


# Square of the sum of two unit vectors that counts as none.
_OPPOSITE = 1e-12
#: 1 or -1, for all poses or one by one.
Sign = int | np.ndarray


@frozen
class Aim:
    """The two unit vectors b = level +- across at given angles to two directions a and d."""

    level: Any  # (3,) or (3, N); 0 where b is at right angles to both
    across: np.ndarray  # (3,) or (3, N)
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
        return Aim(0, quotient(normal, square_root(square)), 0)
    g = dot(a, d)
    x, y = quotient(to_a - g * to_d, square), quotient(to_d - g * to_a, square)
    left = 1 - x * to_a - y * to_d
    across = normal * square_root(quotient(positive_part(left), square))
    return Aim(a * x + d * y, across, lack_of(left))


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
        for i, x in enumerate(tidy_numbers(d))
        for sign in (1, -1)
    ]
    _, i, sign = max(worst)
    return sign * np.eye(3, dtype=int)[i]


@frozen
class Stretch:
    """Coordinate of a slide [m] from a length: ``length + offset``."""

    length: Any
    offset: Any

    @property
    def coordinate(self) -> Any:
        """The coordinate itself."""
        return self.length + self.offset

    def of(self, beam: TelescopicBeam) -> Any:
        """Length of a beam of the telescope that slides."""
        return self.length * beam.share + (beam.fixed + beam.share * self.offset)


@frozen
class ClosedLeg:
    """Bodies of a closed leg; joints and places are those of the main path of its chain."""

    bodies: dict[int, LegBody]  # a body begins after that many elementary joints
    # dict of int to (3,): axes of spherical joints, which may have any three
    ball_axes: dict[int, np.ndarray]
    # Squares that vanish when the leg closes. Of numbers at poses nothing is kept here: gaps of the
    # placed chain say more.
    misses: list[Any]
    # Positive where the leg is too short or too long, or its axes cannot reach the directions
    out_of_reach: list[Any]
    slides: dict[int, Stretch] = field(default_factory=dict)  # by place in the coordinate vector
    loss: Any = 0  # digits that the closure loses

    def after(self, joints: int) -> LegBody:
        """The body that follows so many elementary joints."""
        return self.bodies[max(start for start in self.bodies if start <= joints)]

    def angle(self, place: int, axis: np.ndarray, ahead: np.ndarray, across: np.ndarray) -> Any:
        """Angle of the turn at a place about an axis, from one direction across it to another.

        At zero coordinates: axis of the joint, `ahead` of the body before it, `across` of that
        after it (3,).
        """
        near, far = self.after(place), self.after(place + 1)
        before, after = near.direction(ahead), far.direction(across)
        sine = dot(near.direction(axis), cross(before, after))
        return arc_tangent(sine, dot(before, after))
