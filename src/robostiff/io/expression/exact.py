"""Exact arithmetic for expressions: decimal texts as fractions, degrees as parts of pi, symbols."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType
from typing import Any

from robostiff.io.expression.functions import Mathematics, Refusal
from robostiff.io.units import Quantity, Unit, exact_quantity
from robostiff.spatial.formula import exact_number, is_possible

_MOST_BITS = 4096  # of a fraction: far more than data need, far less than the memory


@cache
def exact_mathematics() -> Mathematics:
    """The functions of SymPy expressions.

    Examples
    --------
    >>> from robostiff.io.expression import parse
    >>> parse("0.25 mm * cos(120 deg)").evaluate({}, exact_mathematics()).magnitude
    -1/8000
    """
    import sympy as sp

    def hypot(*values: Any) -> Any:
        return sp.sqrt(sum(value**2 for value in values))

    functions = {
        "sin": sp.sin,
        "cos": sp.cos,
        "tan": sp.tan,
        "asin": sp.asin,
        "acos": sp.acos,
        "atan": sp.atan,
        "atan2": sp.atan2,
        "sqrt": sp.sqrt,
        "abs": sp.Abs,
        "min": sp.Min,
        "max": sp.Max,
        "hypot": hypot,
        "pow": _power,
    }
    return Mathematics(
        MappingProxyType(functions),
        MappingProxyType({"pi": sp.pi}),
        is_possible,
        _number,
        exact_number,
    )


def _number(digits: str, unit: Unit | None) -> Quantity:
    import sympy as sp

    # Numbers far below the range of floats would need too much memory.
    value = sp.Rational(digits) if float(digits) else sp.Integer(0)
    return exact_quantity(value, unit)


def _power(base: Any, exponent: Any) -> Any:
    if base.is_Rational and exponent.is_Rational:
        bits = max(int(base.p).bit_length(), int(base.q).bit_length())
        if bits * abs(float(exponent)) > _MOST_BITS:
            raise Refusal(
                f"a power of {_MOST_BITS} binary digits or more", "a number that can be written out"
            )
    return base**exponent
