"""Factors of a recorded stiffness matrix: safety of its rank, compliance and deflection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robostiff.record import Entry, is_zero
from robostiff.recorded.elimination import least_size, usual_size

_LOST = 1e-11  # of a diagonal entry: what is left of it is rounding

#: Upper triangle of a symmetric matrix.
Upper = Mapping[tuple[int, int], Any]


@dataclass(frozen=True)
class Factors:
    """K = sum over pivots of l l^T d, the pivots in a safe order.

    Attributes
    ----------
    columns : list of lists
        l of each pivot; 1 at the pivot, 0 at those before.
    d : list of entries or numbers
    pivots : list of int
    losses : list of entries or numbers
        By how much each pivot is smaller than its diagonal entry, and than that at the samples.
    size : int
    """

    columns: list[list[Any]]
    d: list[Any]
    pivots: list[int]
    losses: list[Any]
    size: int

    @property
    def rank(self) -> int:
        """Rank at a general pose."""
        return len(self.pivots)

    def solved(self, F: Sequence[Any]) -> list[Any]:
        """Solution x of K x = F, for K of full rank."""
        left = list(F)
        y: list[Any] = []
        for column, pivot in zip(self.columns, self.pivots, strict=True):
            own = left[pivot]
            y.append(own)
            if not is_zero(own):
                left = [a if is_zero(c) else a - c * own for a, c in zip(left, column, strict=True)]
        x: list[Any] = [0] * self.size
        for column, pivot, d, own in reversed(
            list(zip(self.columns, self.pivots, self.d, y, strict=True))
        ):
            total = own / d
            for i, c in enumerate(column):
                if i != pivot and not (is_zero(c) or is_zero(x[i])):
                    total = total - c * x[i]
            x[pivot] = total
        return x


def factors_of(K: Upper, size: int) -> Factors:
    """Symmetric elimination of K, the largest part left of a diagonal entry first.

    The order is chosen at the samples once for all poses; a pivot that vanishes elsewhere shows in
    its loss.
    """
    left = [[K[min(i, j), max(i, j)] for j in range(size)] for i in range(size)]
    diagonal = [left[i][i] for i in range(size)]
    first = [least_size(x) for x in diagonal]
    columns, d, pivots, losses = [], [], [], []
    open_ = list(range(size))
    while open_:
        part = {i: least_size(left[i][i]) / first[i] if first[i] > 0 else 0.0 for i in open_}
        pivot = max(open_, key=lambda i: part[i])
        if part[pivot] <= _LOST:
            break
        open_.remove(pivot)
        own = left[pivot][pivot]
        if isinstance(own, Entry):
            losses.append(_usual(diagonal[pivot]) / own)
            if own is not diagonal[pivot]:
                losses.append(diagonal[pivot] / own)
        column: list[Any] = [0] * size
        column[pivot] = 1
        for i in open_:
            column[i] = left[pivot][i] / own
        for i in open_:
            for j in open_:
                if j >= i and not is_zero(column[i]):
                    left[i][j] = left[j][i] = left[i][j] - column[i] * left[pivot][j]
        columns.append(column)
        d.append(own)
        pivots.append(pivot)
    return Factors(columns, d, pivots, losses, size)


def inverse_entries(factors: Factors) -> dict[tuple[int, int], Any]:
    """Upper triangle of K^-1, for K of full rank."""
    inverse: dict[tuple[int, int], Any] = {}
    for j in range(factors.size):
        column = factors.solved([int(i == j) for i in range(factors.size)])
        for i in range(j + 1):
            inverse[i, j] = column[i]
    return inverse


def _usual(value: Any) -> float:
    return usual_size(value) if isinstance(value, Entry) else float(value)
