"""Checks of numbers that are given as elastic properties."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np

from robostiff.elasticity.bounds import Bounds
from robostiff.errors import InputError
from robostiff.spatial import in_si, refuse_quantities
from robostiff.spatial.formula import is_formula, is_possible

_A_NUMBER = "a positive finite number"
_RATIO = "a number between -1 and 0.5, both excluded (isotropic material)"
_BY_MODULI = "any other material is written by its moduli: Material(name, E, G, source)"


def positive_number(subject: str, value: Any, unit: str, hint: str | None = None) -> Any:
    """A positive value: a number as a float, a formula unchanged; InputError otherwise."""
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
        raise InputError(
            subject,
            got=values,
            expected=expected + " or an array of them",
            hint="with exact or symbolic entries, call cantilever_compliance",
        )
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
