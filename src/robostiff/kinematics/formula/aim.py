"""The second axis of a universal joint whose first axis and rod are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.kinematics.formula.tidy import tidied
from robostiff.record import Entry, is_zero, least, square_root
from robostiff.spatial import cross


@dataclass(frozen=True)
class Aim:
    """The two unit vectors b = level +- across at given angles to two directions a and d.

    Attributes
    ----------
    level, across : (3,) arrays
    normal : (3,) array
        a x d.
    square : Entry or number
        |a x d|^2.
    gap : Entry or number
        0 where such vectors exist, else of the size of the square of what is missing.
    """

    level: np.ndarray
    across: np.ndarray
    normal: np.ndarray
    square: Any
    gap: Any

    def way(self, sign: int) -> np.ndarray:
        """That with ``b.(a x d)`` of a sign, 1 or -1."""
        return self.level + (self.across if sign > 0 else -self.across)


def aim(a: np.ndarray, d: np.ndarray, to_a: Any, to_d: Any) -> Aim:
    """Unit vectors b with b.a = to_a and b.d = to_d, b = x a + y d +- z (a x d).

    With g = a.d and D = 1 - g^2::

        x = (to_a - g to_d) / D,  y = (to_d - g to_a) / D,  z = sqrt((1 - x to_a - y to_d) / D)

    At right angles to both, b = +-(a x d) / |a x d|. Where the angles cannot be had, z = 0.

    Parameters
    ----------
    a, d : (3,) arrays
        Unit vectors, not parallel.
    to_a, to_d : Entry or number
        Cosines.
    """
    normal = cross(a, d)
    square = normal @ normal
    if is_zero(to_a) and is_zero(to_d):
        return Aim(np.zeros(3, dtype=int), normal / square_root(square), normal, square, 0)
    g = a @ d
    x, y = (to_a - g * to_d) / square, (to_d - g * to_a) / square
    left = 1 - x * to_a - y * to_d
    across = normal * square_root(positive_part(left) / square)
    return Aim(a * x + d * y, across, normal, square, -least(left, 0))


def positive_part(value: Any) -> Any:
    """The larger one of a value and 0."""
    return -least(-value, 0) if isinstance(value, Entry) else max(value, 0)


def shortest_turn_of(
    start: np.ndarray, sides: tuple[np.ndarray, ...], end: np.ndarray
) -> list[np.ndarray]:
    """What directions across `start` become when the shortest turn brings it to `end`.

    ``m - (m.end) / (1 + start.end) (start + end)`` for each; regular unless the two are opposite.

    Parameters
    ----------
    start, end : (3,) arrays
        Unit vectors.
    sides : (3,) arrays
        Perpendicular to `start`.
    """
    both = start + end
    part = 1 / (1 + start @ end)
    return [m - both * ((m @ end) * part) for m in sides]


def coordinate_axis_along(d: np.ndarray) -> np.ndarray:
    """The coordinate axis, forward or backward, from which a direction is never far.

    Returns
    -------
    (3,) array of integers
    """
    worst = [
        (float(np.min(np.asarray(sign * x.sample if isinstance(x, Entry) else sign * x))), i, sign)
        for i, x in enumerate(tidied(d))
        for sign in (1, -1)
    ]
    _, i, sign = max(worst)
    return sign * np.eye(3, dtype=int)[i]
