"""Eigenvalues of symmetric 2 x 2 and 3 x 3 matrices in closed form, recorded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Any

from robostiff.errors import InputError
from robostiff.record import arc_tangent, cosine, sine, square_root

_TINY = 1e-290  # keeps angles defined where all eigenvalues are equal


def eigenvalues(A: Sequence[Sequence[Any]]) -> list[Any]:
    """Eigenvalues of a symmetric matrix of 1, 2 or 3 rows, smallest first.

    For three rows, with q = tr A / 3, B = A - q I, J2 = tr B^2 / 2 and J3 = det B::

        lambda = q + 2 sqrt(J2 / 3) cos(phi + 2 pi k / 3),  tan 3 phi = sqrt(D) / (sqrt(27) J3)

    D = 4 J2^3 - 27 J3^2 is the discriminant, the Gram determinant of I, B and B^2. It is summed
    from squares of their minors (Cauchy-Binet), so that no digits are lost where eigenvalues meet.

    Raises
    ------
    InputError
        For another size.

    Examples
    --------
    >>> [round(x, 12) for x in eigenvalues([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 5.0]])]
    [1.0, 3.0, 5.0]
    """
    n = len(A)
    if n == 1:
        return [A[0][0]]
    if n == 2:
        middle, half = (A[0][0] + A[1][1]) * 0.5, (A[0][0] - A[1][1]) * 0.5
        swing = square_root(half * half + A[0][1] * A[0][1])
        return [middle - swing, middle + swing]
    if n != 3:
        raise InputError("eigenvalues in closed form", got=n, expected="1 to 3 rows")
    q = (A[0][0] + A[1][1] + A[2][2]) / 3
    b = [A[0][0] - q, A[1][1] - q, A[2][2] - q]
    o = [A[1][2], A[0][2], A[0][1]]  # the entry opposite to each diagonal one
    squares = [x * x for x in o]
    c = [
        b[0] * b[0] + squares[1] + squares[2],
        b[1] * b[1] + squares[0] + squares[2],
        b[2] * b[2] + squares[0] + squares[1],
    ]
    p = [o[1] * o[2] - b[0] * o[0], o[0] * o[2] - b[1] * o[1], o[0] * o[1] - b[2] * o[2]]
    J2 = (c[0] + c[1] + c[2]) * 0.5
    J3 = (
        b[0] * (b[1] * b[2] - squares[0])
        - o[2] * (o[2] * b[2] - o[0] * o[1])
        + o[1] * (o[2] * o[0] - b[1] * o[1])
    )
    D = _discriminant(b, o, c, p)
    phi = arc_tangent(square_root(D), math.sqrt(27.0) * J3 + _TINY) / 3
    size = square_root(J2 * (1 / 3)) * 2
    along, across = size * cosine(phi), size * sine(phi) * math.sqrt(0.75)
    low = q - along * 0.5
    return [low - across, low + across, q + along]


def _discriminant(b: list[Any], o: list[Any], c: list[Any], p: list[Any]) -> Any:
    """Product of the squared differences of the eigenvalues, from minors of I, B, B^2.

    B has diagonal b and off-diagonal entries o, B^2 has c and p (p = entries of B^2 by the
    characteristic equation: the entry of B^2 opposite to i is o_j o_k - b_i o_i).
    """
    whole = (b[1] - b[0]) * (c[2] - c[0]) - (b[2] - b[0]) * (c[1] - c[0])
    total = whole * whole
    of_one: Any = 0
    for i, j in combinations(range(3), 2):
        db, dc = b[j] - b[i], c[j] - c[i]
        for k in range(3):
            minor = db * p[k] - o[k] * dc
            of_one = of_one + minor * minor
    of_two: Any = 0
    for k, m in combinations(range(3), 2):
        minor = o[k] * p[m] - o[m] * p[k]
        of_two = of_two + minor * minor
    return total + of_one * 2 + of_two * 12
