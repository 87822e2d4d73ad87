"""Rotations on recorded entries: every turn is a pair of cosine and sine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import cosine, is_number, is_one, is_zero, sine, square_root

_TINY = 1e-300  # keeps the root of a vanishing angle regular


@dataclass(frozen=True)
class Turn:
    """A rotation by an angle that only its cosine and sine tell.

    Attributes
    ----------
    cosine, sine : Entry or number
    """

    cosine: Any
    sine: Any

    @classmethod
    def by(cls, angle: Any) -> Turn:
        """The turn by an angle [rad], an entry or a number."""
        return cls(cosine(angle), sine(angle))

    def about(self, axis: np.ndarray) -> np.ndarray:
        """Rotation matrix c I + s (e x) + (1 - c) e e^T about a unit vector e.

        Parameters
        ----------
        axis : (3,) array
            e, entries or numbers.

        Returns
        -------
        (3, 3) array of objects

        Examples
        --------
        >>> Turn(0, 1).about(np.array([0, 0, 1])).astype(int).tolist()
        [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        """
        c, s = self.cosine, self.sine
        R = np.empty((3, 3), dtype=object)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            square = axis[i] * axis[i]
            R[i, i] = 1 if is_one(square) else c if is_zero(square) else c + (1 - c) * square
            shared, turned = axis[i] * axis[j], s * axis[k]
            even = 0 if is_zero(shared) else (1 - c) * shared
            R[i, j], R[j, i] = even - turned, even + turned
        return R


def turn_by_vector_of_entries(r: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector through the unit quaternion (cos(a/2), sin(a/2) r/a).

    It is regular at r = 0. A vector along one coordinate axis gives one cosine and one sine.

    Parameters
    ----------
    r : (3,) array of objects
        Rotation vector [rad]; a = |r|.

    Returns
    -------
    (3, 3) array of objects

    Examples
    --------
    >>> turn_by_vector_of_entries(np.array([0, 0, 0], dtype=object)).astype(float).trace()
    np.float64(3.0)
    """
    turning = [i for i in range(3) if not is_zero(r[i])]
    if len(turning) <= 1:
        k = turning[0] if turning else 2
        return Turn.by(r[k]).about(np.eye(3, dtype=int)[k])
    a = square_root(r @ r + (0 if all(map(is_number, r)) else _TINY))
    half = Turn.by(a * 0.5)
    # u u^T = 2 v v^T and w u = 2 c v for the quaternion (c, v)
    u = r * (half.sine / a * math.sqrt(2.0))
    w = half.cosine * math.sqrt(2.0)
    squares = u * u
    R = np.empty((3, 3), dtype=object)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        R[i, i] = 1 - (squares[j] + squares[k])
        even, odd = u[i] * u[j], w * u[k]
        R[i, j], R[j, i] = even - odd, even + odd
    return R
