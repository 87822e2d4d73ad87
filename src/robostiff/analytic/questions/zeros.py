"""Which factors of a locus are zero anywhere, by numbers: signs at samples, and least values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import minimize

from robostiff.analytic.exact.definition import Condition
from robostiff.analytic.exact.operation_count import count_of

_SAMPLES = 4000
_FEWEST = 100  # samples at which the conditions hold, for an answer by signs
_STARTS = 4
_ROUNDING = 1e-13  # of the sum of the sizes of its terms
_ZERO = 1e-10
_ALIKE = 1e-2  # the same of another factor at such a zero, of high order
_NEAR = 0.1  # a symbol there, of the largest
_LONG = 60  # operations
_SEED = 29


@dataclass(frozen=True)
class Samples:
    """Random values of symbols, of their signs or of either, at which conditions hold."""

    symbols: tuple[sp.Symbol, ...]
    conditions: tuple[Condition, ...] = ()
    signed: bool = False  # whether positive symbols have positive values only

    @cached_property
    def values(self) -> np.ndarray:
        """Values (m, symbols) between 0.1 and 3 in size, spread evenly by their logarithms."""
        random = np.random.default_rng(_SEED)
        shape = _SAMPLES, len(self.symbols)
        values = np.exp(random.uniform(np.log(0.1), np.log(3.0), shape))
        if self.symbols:
            signs = random.choice([-1.0, 1.0], shape)
            values *= np.where(
                [self.signed and bool(x.is_positive) for x in self.symbols], 1, signs
            )
        for condition in self.conditions:
            with np.errstate(all="ignore"):
                values = values[self._function(condition.expression)(*values.T) > 0]
        return values

    def _function(self, expression: Any) -> Callable[..., Any]:
        found = sp.lambdify(self.symbols, expression, "numpy", cse=True)
        return lambda *at: np.broadcast_to(np.real(found(*at)), np.shape(at[0]))

    def relative(self, factor: Any) -> Callable[[np.ndarray], np.ndarray]:
        """Values of a sum by the sizes of its terms, as a function of values (..., symbols)."""
        terms = sp.Add.make_args(factor)
        size = self._function(sp.Add(*map(sp.Abs, terms)))
        value = self._function(factor)

        def ratio(at: np.ndarray) -> np.ndarray:
            with np.errstate(all="ignore"):
                return np.nan_to_num(value(*at.T) / size(*at.T))

        return ratio

    def zeros(self, factor: Any) -> np.ndarray | None:
        """Points (m, symbols) at which a factor is zero and changes no sign; None if it does.

        Empty for one that is not zero anywhere.
        """
        relative = self.relative(factor)
        values = relative(self.values)
        if len(values) < _FEWEST or max(values) > _ROUNDING < -min(values):
            return None
        found = []
        for start in self.values[np.argsort(np.abs(values))[:_STARTS]]:
            exact = {"xatol": 1e-12, "fatol": 1e-18, "maxfev": 400 * len(start)}
            end = minimize(lambda x: abs(relative(x)), start, method="Nelder-Mead", options=exact)
            inside = not self.signed or all(
                x > 0 for s, x in zip(self.symbols, end.x, strict=True) if s.is_positive
            )
            if end.fun < _ZERO and inside:
                found.append(end.x)
        return np.reshape(found, (-1, len(self.symbols)))

    def are_zeros(self, factors: Sequence[Any], at: np.ndarray) -> bool:
        """Whether one of the factors is nearly zero at a point."""
        small = {s for s, x in zip(self.symbols, at, strict=True) if abs(x) < _NEAR * abs(at).max()}
        return any(
            x in small if x.is_Symbol else abs(self.relative(x)(at)) < _ALIKE for x in factors
        )


def independent_zeros(factors: Sequence[Any]) -> tuple[Any, ...]:
    """Factors without those that are zero nowhere, or only where shorter ones are.

    Sines and cosines have a relation, so that a factor may be a multiple of another by a sum of
    squares without being divisible by it. A factor that changes its sign is kept; a long one where
    it does so for symbols of their signs.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> independent_zeros([x**2 + 3, x**2 - 2 * x * y + y**2, x - y, x])
    (x - y, x)
    """
    symbols = tuple(sorted(set().union(*(x.free_symbols for x in factors)), key=str))
    kept: list[Any] = []
    for factor in sorted(factors, key=count_of):
        samples = Samples(symbols, signed=count_of(factor) > _LONG)
        points = None if factor.is_Symbol else samples.zeros(factor)
        if points is None or any(not samples.are_zeros(kept, at) for at in points):
            kept.append(factor)
    return tuple(x for x in factors if x in kept)


def may_vanish(factor: Any, conditions: Sequence[Condition]) -> bool:
    """Whether a factor is zero for symbols of their signs where conditions hold, or beside it."""
    symbols = factor.free_symbols.union(*(c.expression.free_symbols for c in conditions))
    samples = Samples(tuple(sorted(symbols, key=str)), tuple(conditions), signed=True)
    points = samples.zeros(factor)
    return points is None or len(points) > 0
