"""Sparse systems of equations on recorded entries, solved with pivots that are chosen once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import reduce
from operator import mul
from typing import Any

import numpy as np

from robostiff.record import Entry, is_number, is_zero

_LOST = 1e-8  # of an entry at all samples: what is left of it is rounding
# A pivot is safe that at no sample falls below this part of the largest in its column, and of its
# own mean over the samples.
_OF_COLUMN, _OF_ITSELF = 0.15, 0.3


@dataclass(eq=False)
class LinearEquation:
    """One equation, sum of rates times unknowns = right side."""

    rates: dict[str, Any]  # without zeros
    right: Any


@dataclass
class SparseElimination:
    """Gaussian elimination of equations that share few unknowns, group after group.

    The order of pivots is chosen at the samples: safe ones first, and among those the one that
    fills in least (Markowitz). Where a chosen pivot vanishes elsewhere, so does the determinant of
    its group.

    Examples
    --------
    >>> elimination = SparseElimination()
    >>> equations = [LinearEquation({"x": 1, "y": 1}, 3), LinearEquation({"x": 1, "y": -1}, 1)]
    >>> elimination.eliminate(equations, ["x", "y"])
    []
    >>> sorted(elimination.solution().items())
    [('x', 2.0), ('y', 1.0)]
    """

    # Of each group, in the order of elimination
    pivots: list[list[Any]] = field(default_factory=list)
    undetermined: list[str] = field(default_factory=list)  # unknowns that no equation determines
    _solved_for: list[tuple[str, LinearEquation]] = field(default_factory=list)
    _sizes: dict[int, tuple[float, float]] = field(default_factory=dict)

    def eliminate(
        self, equations: Iterable[LinearEquation], unknowns: Iterable[str]
    ) -> list[LinearEquation]:
        """The equations that are left when unknowns are eliminated where they stand."""
        left, open_ = list(equations), list(unknowns)
        pivots = []
        while (found := self._next(left, open_)) is not None:
            own, name = found
            left.remove(own)
            open_.remove(name)
            pivot = own.rates.pop(name)
            pivots.append(pivot)
            own = LinearEquation(
                {other: rate / pivot for other, rate in own.rates.items()}, own.right / pivot
            )
            self._solved_for.append((name, own))
            for equation in left:
                if name in equation.rates:
                    self._subtract(equation, equation.rates.pop(name), own)
        self.pivots.append(pivots)
        self.undetermined += open_
        return left

    def solution(self) -> dict[str, Any]:
        """Every unknown; 0 for those that no equation determines."""
        found: dict[str, Any] = dict.fromkeys(self.undetermined, 0)
        for name, equation in reversed(self._solved_for):
            value = equation.right
            for other, rate in equation.rates.items():
                if not is_zero(found[other]):
                    value = value - rate * found[other]
            found[name] = value
        return found

    def determinants(self) -> list[Any]:
        """Of each group of which pivots were taken, but for a constant sign."""
        return [reduce(mul, own) for own in self.pivots if own]

    def _subtract(self, equation: LinearEquation, factor: Any, taken: LinearEquation) -> None:
        for name, rate in taken.rates.items():
            value = equation.rates.pop(name, 0) - factor * rate
            if self._size(value)[1] > _LOST:
                equation.rates[name] = value
        equation.right = equation.right - factor * taken.right

    def _next(
        self, equations: list[LinearEquation], unknowns: list[str]
    ) -> tuple[LinearEquation, str] | None:
        open_ = set(unknowns)
        counts = dict.fromkeys(unknowns, 0)
        largest = dict.fromkeys(unknowns, 0.0)
        for equation in equations:
            for name in open_ & equation.rates.keys():
                counts[name] += 1
                largest[name] = max(largest[name], self._size(equation.rates[name])[1])
        best: tuple[Any, ...] = ()
        for number, equation in enumerate(equations):
            own = [name for name in unknowns if name in equation.rates]
            most = max((self._size(equation.rates[name])[1] for name in own), default=0.0)
            entries = sum(isinstance(rate, Entry) for rate in equation.rates.values())
            for name in own:
                rate = equation.rates[name]
                least, usual = self._size(rate)
                part = least / largest[name]
                safe = part > _OF_COLUMN and least > _OF_ITSELF * usual
                fill = (len(equation.rates) - 1) * (counts[name] - 1) + (not is_number(rate))
                order = (0, fill, entries) if safe else (1, 0, 0)
                key = (*order, -part * least / most, number, name)
                best = min(best, key) if best else key
        return None if not best else (equations[best[-2]], best[-1])

    def _size(self, value: Any) -> tuple[float, float]:
        """Least and mean size over the samples."""
        if not isinstance(value, Entry):
            return abs(float(value)), abs(float(value))
        if value.step not in self._sizes:
            size = np.abs(value.sample)
            self._sizes[value.step] = float(np.min(size)), float(np.mean(size))
        return self._sizes[value.step]
