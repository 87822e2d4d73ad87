"""Exact numbers, those of SymPy: which they are, and how long they may become."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

_LONGEST = 40  # characters of an exact root
_BITS = int(_LONGEST * 3.33)  # of a fraction that takes as many


def is_exact(value: Any) -> bool:
    """Whether a number is one of SymPy's, which stays as it is."""
    return hasattr(value, "is_number")


def entry_by_entry(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The same function, over arrays of objects as well, and those of floats where NumPy has it."""
    of_floats = {"square_root": np.sqrt, "sine": np.sin, "cosine": np.cos}.get(function.__name__)

    of_entries = np.frompyfunc(function, 1, 1)

    @wraps(function)
    def over_arrays(x: Any) -> Any:
        if not isinstance(x, np.ndarray):
            return function(x)
        if of_floats is not None and x.dtype != object:
            return of_floats(x)
        return np.asarray(of_entries(x), dtype=object)

    return over_arrays


def exact_root(x: Any) -> Any:
    """Square root of an exact number, or the decimal of its float where it would be long."""
    import sympy as sp

    if x.is_Rational and _bits(x) > 3 * _BITS:
        # Its root is no shorter than a third; to find that out, SymPy would look for factors.
        return sp.Rational(repr(float(sp.sqrt(x.n(30)))))
    root = sp.sqrt(x)
    # Roots of long fractions under further roots grow beyond what can be computed with.
    if root.is_number and (_bits(root) > 3 * _BITS or len(str(root)) > _LONGEST):
        return sp.Rational(repr(float(root)))
    return root


@entry_by_entry
def shortened(x: Any) -> Any:
    """An exact number, or the decimal of its float where its fractions are long.

    Sums of quotients of decimals double their digits again and again.
    """
    if not is_exact(x) or not x.is_number or _bits(x) <= 3 * _BITS:
        return x
    import sympy as sp

    return sp.Rational(repr(float(x)))


def _bits(number: Any) -> int:
    """Of all fractions in an exact number: Python refuses to write out the longest."""
    if number.is_Rational:
        return number.p.bit_length() + number.q.bit_length()
    import sympy as sp

    return sum(q.p.bit_length() + q.q.bit_length() for q in number.atoms(sp.Rational))


def exact_value(name: str, x: Any) -> Any:
    """A function of SymPy."""
    import sympy as sp

    return getattr(sp, name)(x)
