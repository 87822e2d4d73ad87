"""A rod of a leg: how its joints aim directions, and the slide or crank that drives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.kinematics.closure.body import (
    LegBody,
    Rest,
    cross,
    dot,
    frame,
    positive_part,
    quotient,
    root,
    tidied,
    tidied_point,
)
from robostiff.kinematics.closure.leg_forms import Cluster, Slide
from robostiff.record import Entry, is_zero, least, square_root

# Square of the sum of two unit vectors that counts as none.
_OPPOSITE = 1e-12
#: 1 or -1, for all poses or one by one.
Sign = int | np.ndarray


@dataclass(frozen=True)
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
        return Aim(0, quotient(normal, root(square)), 0)
    g = dot(a, d)
    x, y = quotient(to_a - g * to_d, square), quotient(to_d - g * to_a, square)
    left = 1 - x * to_a - y * to_d
    across = normal * root(quotient(positive_part(left), square))
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
