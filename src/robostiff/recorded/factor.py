"""Factors of a recorded stiffness matrix: safety of its rank, compliance and deflection."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.record import (
    Entry,
    arc_tangent,
    cosine,
    is_zero,
    least_size,
    plain_root,
    sine,
    usual_size,
)

_LOST = 1e-11  # of a diagonal entry: what is left of it is rounding

#: Upper triangle of a symmetric matrix.
Upper = Mapping[tuple[int, int], Any]


@frozen
class Factors:
    """K = sum over pivots of l d u^T."""

    #: columns, rows: list of lists: l and u of each pivot, alike where K is symmetric; 1 at the
    #: pivot, 0 at those before
    columns: list[list[Any]]
    rows: list[list[Any]]
    d: list[Any]  #: list of entries or numbers: all positive where K is positive definite
    pivots: list[int]
    #: list of entries or numbers: by how much each pivot is smaller than the sum of its diagonal
    #: entry and that at the samples
    losses: list[Any]
    size: int

    @property
    def rank(self) -> int:
        """Rank at a general pose."""
        return len(self.pivots)

    def solution(self, F: Sequence[Any]) -> list[Any]:
        """Solution x of K x = F, for K of full rank."""
        rest = list(F)
        y: list[Any] = []
        for column, pivot in zip(self.columns, self.pivots, strict=True):
            y_k = rest[pivot]
            y.append(y_k)
            if not is_zero(y_k):
                rest = [a if is_zero(c) else a - c * y_k for a, c in zip(rest, column, strict=True)]
        x: list[Any] = [0] * self.size
        steps = zip(self.rows, self.pivots, self.d, y, strict=True)
        for row, pivot, d, y_k in reversed(list(steps)):
            total = y_k / d
            for i, u in enumerate(row):
                if i != pivot and not (is_zero(u) or is_zero(x[i])):
                    total = total - u * x[i]
            x[pivot] = total
        return x


def factors_of(
    K: Upper, size: int, antisymmetric: np.ndarray | None = None, *, in_order: bool = False
) -> Factors:
    """Elimination of K, or of ``K + A``: the largest part left of a diagonal entry first.

    The order is chosen at the samples once for all poses; a pivot that vanishes elsewhere shows in
    its loss. Rows that are taken in their own order may be those of a positive definite matrix
    alone. Up to the first row in which A is not zero, the rest stays symmetric.

    Parameters
    ----------
    K : mapping of (row, column) to entries or numbers
        Upper triangle.
    size : int
        n.
    antisymmetric : (n, n) array of entries and numbers, optional
        A; zero when left out.
    in_order : bool
        Whether rows are taken in their own order.
    """
    M = [[K[min(i, j), max(i, j)] for j in range(size)] for i in range(size)]
    A = np.zeros((size, size), dtype=int) if antisymmetric is None else antisymmetric
    diagonal = [M[i][i] for i in range(size)]
    first = [least_size(x) for x in diagonal]
    columns, rows, d, pivots, losses, whole = [], [], [], [], [], False
    open_ = list(range(size))
    while open_:
        pivot = open_[0]
        if not in_order:
            part = {i: least_size(M[i][i]) / first[i] if first[i] > 0 else 0.0 for i in open_}
            pivot = max(open_, key=lambda i: part[i])
            if part[pivot] <= _LOST:
                break
        if not (whole or all(map(is_zero, A[pivot]))):
            whole = True
            for i, j in combinations(open_, 2):
                M[i][j], M[j][i] = M[i][j] + A[i, j], M[j][i] + A[j, i]
        open_.remove(pivot)
        d_k = M[pivot][pivot]
        if isinstance(d_k, Entry):
            usual = usual_size(diagonal[pivot])
            losses.append((usual if d_k is diagonal[pivot] else diagonal[pivot] + usual) / d_k)
        column: list[Any] = [0] * size
        row: list[Any] = [0] * size
        column[pivot] = row[pivot] = 1
        for i in open_:
            row[i] = M[pivot][i] / d_k
            column[i] = M[i][pivot] / d_k if whole else row[i]
        for i in open_:
            for j in open_:
                if (whole or j >= i) and not is_zero(column[i]):
                    M[i][j] = M[i][j] - column[i] * M[pivot][j]
                    if not whole:
                        M[j][i] = M[i][j]
        columns.append(column)
        rows.append(row)
        d.append(d_k)
        pivots.append(pivot)
    return Factors(columns, rows, d, pivots, losses, size)


def inverse_entries(factors: Factors) -> dict[tuple[int, int], Any]:
    """Upper triangle of K^-1, for K of full rank."""
    inverse: dict[tuple[int, int], Any] = {}
    for j in range(factors.size):
        column = factors.solution([int(i == j) for i in range(factors.size)])
        for i in range(j + 1):
            inverse[i, j] = column[i]
    return inverse


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
    """
    n = len(A)
    if n == 1:
        return [A[0][0]]
    if n == 2:
        middle, half = (A[0][0] + A[1][1]) * 0.5, (A[0][0] - A[1][1]) * 0.5
        swing = plain_root(half * half + A[0][1] * A[0][1])
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
    # From minors of I, B and B^2, which has diagonal c, and off the diagonal p: by the
    # characteristic equation its entry opposite to i is o_j o_k - b_i o_i.
    whole = (b[1] - b[0]) * (c[2] - c[0]) - (b[2] - b[0]) * (c[1] - c[0])
    of_one: Any = 0
    of_two: Any = 0
    for i, j in combinations(range(3), 2):
        minors = ((b[j] - b[i]) * p[k] - o[k] * (c[j] - c[i]) for k in range(3))
        for minor in minors:
            of_one = of_one + minor * minor
        minor = o[i] * p[j] - o[j] * p[i]
        of_two = of_two + minor * minor
    D = whole * whole + of_one * 2 + of_two * 12
    phi = arc_tangent(plain_root(D), math.sqrt(27.0) * J3 + _TINY) / 3
    size = plain_root(J2 * (1 / 3)) * 2
    along, across = size * cosine(phi), size * sine(phi) * math.sqrt(0.75)
    low = q - along * 0.5
    return [low - across, low + across, q + along]
