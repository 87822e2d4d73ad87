"""Inequalities without which a section, material or drive does not exist."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial.formula import exact_together, is_above


@dataclass(frozen=True)
class Bounds:
    """``low < value < high`` of a number of a part; InputError where that is certainly wrong.

    With ``or_at`` it may be at these bounds.
    """

    subject: str
    value: Any
    low: Any = 0
    high: Any = None
    expected: str = "a positive number"
    hint: str | None = None
    or_at: bool = False

    def __post_init__(self) -> None:
        if any(is_above(0, x, or_at=not self.or_at) for x in self.differences.values()):
            raise InputError(self.subject, got=self.value, expected=self.expected, hint=self.hint)

    @property
    def differences(self) -> dict[str, Any]:
        """What is positive where they hold, by words."""
        low, value, high = exact_together(self.low, self.value, self.high)
        above = {f"{'at least' if self.or_at else 'more than'} {low}": value - low}
        return above if high is None else {**above, self.expected: high - value}

    @property
    def is_open(self) -> bool:
        """Whether a formula leaves them open."""
        return not all(is_above(x, 0, or_at=self.or_at) for x in self.differences.values())


def left_open(bounds: Iterable[Bounds]) -> tuple[Bounds, ...]:
    """Those that formulas leave open; raises InputError for what is no bounds."""
    given = tuple(bounds) if isinstance(bounds, Iterable) else (bounds,)
    if not all(isinstance(x, Bounds) for x in given):
        raise InputError("bounds", got=bounds, expected="a tuple of Bounds, or none")
    return tuple(x for x in given if x.is_open)


def error_at(
    named: Sequence[tuple[str, Bounds]], symbols: tuple[Any, ...], rows: np.ndarray
) -> InputError | None:
    """The first that values (symbols, N) do not meet, with names of parts; None of all met."""
    formulas = [x for _, own in named for x in (own.low, own.value, own.high) if x is not None]
    with np.errstate(all="ignore"):
        numbers = iter(_function(symbols, tuple(formulas))(*rows))
    for name, own in named:
        low, value = next(numbers), next(numbers)
        rounding = 1e-12 if own.or_at else 0.0  # 1 - 0.9 - 0.1 is below zero
        met = low < value + rounding
        if own.high is not None:
            met = met & (value < next(numbers) + rounding)
        if not np.all(met):  # of a value that is not a number either
            met, value = (np.broadcast_to(x, rows.shape[1:]) for x in (met, value))
            k = int(np.argmin(met))
            used = {s for x in own.differences.values() for s in x.free_symbols}
            pairs = zip(symbols, rows[:, k].tolist(), strict=True)
            given = ", ".join(f"{symbol} = {x}" for symbol, x in pairs if symbol in used)
            return InputError(
                f"{own.subject} of {name!r} in row {k}, {given}",
                got=float(value[k]),
                expected=own.expected,
                hint=own.hint,
            )
    return None


@lru_cache(maxsize=64)
def _function(symbols: tuple[Any, ...], formulas: tuple[Any, ...]) -> Callable[..., Any]:
    import sympy as sp

    return sp.lambdify(symbols, formulas, "numpy", cse=True)
