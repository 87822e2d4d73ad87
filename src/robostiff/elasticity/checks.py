"""Checks of elastic properties: of numbers, and of formulas by inequalities left open."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from numbers import Real
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import in_si, refuse_quantities
from robostiff.spatial.formula import exact_together, is_above, is_formula, is_possible


@frozen
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
    """The first bound that values (symbols, N) miss, by the names of parts; None if all hold."""
    formulas = [x for _, b in named for x in (b.low, b.value, b.high) if x is not None]
    with np.errstate(all="ignore"):
        numbers = iter(_function(symbols, tuple(formulas))(*rows))
    for name, bound in named:
        low, value = next(numbers), next(numbers)
        rounding = 1e-12 if bound.or_at else 0.0  # 1 - 0.9 - 0.1 is below zero
        inside = low < value + rounding
        if bound.high is not None:
            inside = inside & (value < next(numbers) + rounding)
        if not np.all(inside):  # of a value that is not a number either
            inside, value = (np.broadcast_to(x, rows.shape[1:]) for x in (inside, value))
            k = int(np.argmin(inside))
            used = {s for x in bound.differences.values() for s in x.free_symbols}
            pairs = zip(symbols, rows[:, k].tolist(), strict=True)
            given = ", ".join(f"{symbol} = {x}" for symbol, x in pairs if symbol in used)
            subject, got = f"{bound.subject} of {name!r} in row {k}, {given}", float(value[k])
            return InputError(subject, got=got, expected=bound.expected, hint=bound.hint)
    return None


@lru_cache(maxsize=64)
def _function(symbols: tuple[Any, ...], formulas: tuple[Any, ...]) -> Callable[..., Any]:
    import sympy as sp

    return sp.lambdify(symbols, formulas, "numpy", cse=True)


_A_NUMBER = "a positive finite number"
_RATIO = "a number between -1 and 0.5, both excluded (isotropic material)"
_BY_MODULI = "any other material is written by its moduli: Material(name, E, G, source)"


def positive_number(subject: str, value: Any, unit: str, hint: str | None = None) -> Any:
    """A positive value: a number as a float, a formula unchanged; InputError otherwise."""
    if type(value) is float and 0.0 < value < math.inf:
        return value
    expected = f"{_A_NUMBER} [{unit}]" if unit else _A_NUMBER
    value = in_si(subject, value, expected, None if " or " in unit else unit)
    if is_formula(value):
        if is_possible(value) and getattr(value, "is_positive", None) is not False:
            return value
        raise InputError(subject, got=value, expected=expected, hint=hint)
    if getattr(value, "is_Float", False) and math.isfinite(value):  # of SymPy
        value = float(value)
    if not is_real_number(value) or not (math.isfinite(value) and value > 0):
        raise InputError(subject, got=value, expected=expected, hint=hint)
    return float(value)


def positive_numbers(subject: str, values: Any, unit: str) -> Any:
    """The values `(...)` as floats; InputError names the first that is not finite and positive.

    One formula stays as it is.
    """
    values = in_si(subject, values, f"{_A_NUMBER} [{unit}]", unit)
    if is_formula(values):
        return positive_number(subject, values, unit)
    expected = f"{_A_NUMBER} [{unit}]"
    array = as_array(values)
    if array.dtype.kind not in "iuf":
        hint = "with exact or symbolic entries, call cantilever_compliance"
        raise InputError(subject, got=values, expected=expected + " or an array of them", hint=hint)
    wrong = ~(np.isfinite(array) & (array > 0))
    if wrong.any():
        where = tuple(int(i) for i in np.argwhere(wrong)[0])
        place = f"{subject}[{', '.join(map(str, where))}]" if where else subject
        raise InputError(place, got=array[where].item(), expected=expected)
    return array.astype(np.float64)


def poisson_ratio_of_isotropic(value: Any) -> Any:
    """A Poisson ratio, -1 < value < 0.5: a number as a float, a formula unchanged."""
    value = in_si("Poisson ratio", value, "a number", "")
    formula = is_formula(value)
    if not (is_possible(value) if formula else is_real_number(value) and math.isfinite(value)):
        raise InputError("Poisson ratio", got=value, expected=_RATIO, hint=_BY_MODULI)
    _ = poisson_ratio_bounds(value)
    return value if formula else float(value)


def poisson_ratio_bounds(value: Any) -> Bounds:
    """Those of an isotropic material."""
    return Bounds("Poisson ratio", value, -1, 0.5, _RATIO, _BY_MODULI)


def is_real_number(value: Any) -> bool:
    """Whether the value is a real number (a bool is not)."""
    return isinstance(value, Real) and not isinstance(value, bool)


def as_array(values: Any) -> np.ndarray:
    """The values as a NumPy array; nested lists of unequal lengths become an array of objects."""
    refuse_quantities("numbers of an elastic part", values, "numbers of SI units")
    try:
        return np.asarray(values)
    except ValueError:
        return np.asarray(values, dtype=object)
