"""Arrays of formulas: SymPy expressions and exact numbers in place of floats."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError
from robostiff.spatial.quantities import holds_quantities, refuse_quantities

#: An array of numbers, or lists of numbers and formulas.
Entries = ArrayLike | Sequence[Any]

#: A number, or a formula in its place.
Scalar = Any


def is_formula(value: Any) -> bool:
    """Whether a value stands for a number by a formula, and stays as it is.

    That is whatever has ``free_symbols``: SymPy expressions, exact SymPy numbers such as
    ``Rational(1, 3)`` and ``pi`` among them, and entries of a record. A SymPy Float is a number.

    Examples
    --------
    >>> import sympy as sp
    >>> is_formula(sp.Symbol("L") / 2), is_formula(sp.pi), is_formula(sp.Float(0.5)), is_formula(2)
    (True, True, False, False)
    """
    return _is_formula(type(value))  # whether it has symbols, not which: SymPy looks for these


@cache
def _is_formula(kind: type) -> bool:
    return hasattr(kind, "free_symbols") and not getattr(kind, "is_Float", False)


def is_possible(value: Any) -> bool:
    """Whether a formula may have a real finite value; False only where that is certain."""
    if not _is_sympy(value):
        return True
    import sympy as sp

    if value.has(sp.nan, sp.zoo, sp.oo, -sp.oo):
        return False
    return value.is_extended_real is not False and value.is_finite is not False


def is_above(value: Any, limit: Any, *, or_at: bool = False) -> bool:
    """Whether a value is certainly above a limit (or at it); formulas may leave that open."""
    if any(is_formula(x) and not _is_sympy(x) for x in (value, limit)):
        return False
    claim = value >= limit if or_at else value > limit
    return not getattr(claim, "is_Relational", False) and bool(claim)


def exact_number(value: Any) -> Any:
    """A number as an exact SymPy number, read from its shortest decimal text; formulas stay.

    Raises
    ------
    InputError
        When it is neither a formula nor a finite real number.

    Examples
    --------
    >>> exact_number(0.25), exact_number(3), exact_number(np.float64(0.1))
    (1/4, 3, 1/10)
    """
    refuse_quantities("number", value, "a finite number or a formula")
    if is_formula(value):
        return value
    import sympy as sp

    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = np.nan
    if not np.isfinite(number) or isinstance(value, (bool, str)):
        raise InputError("number", got=value, expected="a finite number or a formula")
    if isinstance(value, int):
        return sp.Integer(value)
    return sp.Rational(repr(number))


def exact_together(*values: Any) -> tuple[Any, ...]:
    """The values as they are; numbers beside a SymPy formula become exact."""
    if not any(map(_is_sympy_kind, map(type, values))):
        return values
    return tuple(value if value is None else exact_number(value) for value in values)


def formula_array(value: Any) -> np.ndarray | None:
    """An array of objects with the formulas of an array-like; None where it has none.

    Plain numbers beside SymPy formulas become exact, so that no float enters a formula unseen.

    Raises InputError when an entry is neither a formula nor a finite number.
    """
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            return None
        if all(map(is_formula, value.flat)):
            return value.copy()
    if holds_quantities(value):
        return None  # `as_floats` converts or refuses them
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    if array.dtype != object or not any(is_formula(entry) for entry in array.flat):
        return None
    return _filled(array.shape, exact_together(*array.flat))


def exact_arrays(*arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    """The arrays as they are; those of floats become exact when another one holds formulas."""
    if not any(_is_sympy(entry) for a in arrays if a.dtype == object for entry in a.flat):
        return arrays
    return tuple(exact_array(array) for array in arrays)


def exact_array(array: np.ndarray) -> np.ndarray:
    """The same array with an exact SymPy number in place of each number."""
    return _filled(array.shape, map(exact_number, array.flat))


def length_of(vector: np.ndarray) -> Any:
    """Length of a vector of formulas: the square root of the sum of squares."""
    import sympy as sp

    # Expanded, a square such as (R - r)^2 stays a root of a polynomial and is no absolute value.
    square = sp.expand(sum(entry**2 for entry in vector))
    if square.has(sp.sin, sp.cos):
        square = sp.trigsimp(square)
    return sp.sqrt(square)


def vanishes(vector: np.ndarray) -> bool:
    """Whether every entry of an array of formulas is zero once multiplied out."""
    import sympy as sp

    return all(entry == 0 or sp.expand(entry) == 0 for entry in vector.flat)


def tidy(vector: np.ndarray) -> np.ndarray:
    """The formulas of an array with squares of sines and cosines summed and fractions cancelled."""
    import sympy as sp

    def tidy(entry: Any) -> Any:
        return sp.cancel(sp.trigsimp(entry) if entry.has(sp.sin, sp.cos) else entry)

    return _filled(vector.shape, map(tidy, vector.flat))


def _filled(shape: tuple[int, ...], entries: Iterable[Any]) -> np.ndarray:
    # Filled one by one: some entries look like sequences to NumPy.
    array = np.empty(math.prod(shape), dtype=object)
    for place, entry in enumerate(entries):
        array[place] = entry
    return array.reshape(shape)


def _is_sympy(value: Any) -> bool:
    return _is_sympy_kind(type(value))


@cache
def _is_sympy_kind(kind: type) -> bool:
    return _is_formula(kind) and hasattr(kind, "xreplace")
