"""Operators and functions on quantities: their units, and a table of functions on numbers.

Every rule takes quantities apart into magnitude and unit. The magnitudes are combined by a
`Mathematics`, a table of functions of one kind of magnitude: `FLOATS` now, another table for exact
symbols.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

from robostiff.errors import InputError, Words, warn_of_slip
from robostiff.frozen import frozen
from robostiff.io.units import Dimension, SIQuantity, Unit, exact_quantity, make_quantity, make_unit
from robostiff.model.checks import FULL_TURN
from robostiff.spatial.formula import exact_number, is_possible

HIGHEST_POWER = 64


def refusal(got: str, expected: str, hint: str | None = None) -> InputError:
    """The error for operands that make no sense; evaluation adds the place."""
    return InputError("operation", got=Words(got), expected=expected, hint=hint)


@frozen
class Mathematics:
    """The functions of one kind of magnitude."""

    # ``pow`` and every name in `RULES`: ArithmeticError or ValueError where they have no value
    functions: Mapping[str, Callable[..., Any]]
    constants: Mapping[str, Any]  # ``pi``
    is_finite: Callable[[Any], bool]  # whether a magnitude can be used as a result
    # the quantity of decimal digits and a unit; None for that of the nearest float
    number: Callable[[str, Unit | None], SIQuantity] | None = None
    bare: Callable[[float], Any] = float  # the magnitude of a plain number


_OF_MATH = "sin cos tan asin acos atan atan2 sqrt hypot pow"
FLOATS = Mathematics(
    MappingProxyType(
        {
            **{name: getattr(math, name) for name in _OF_MATH.split()},
            "abs": abs,
            "min": lambda *values: min(values),
            "max": lambda *values: max(values),
        }
    ),
    MappingProxyType({"pi": math.pi}),
    math.isfinite,
)
"""Ordinary numbers."""

CONSTANTS = frozenset(FLOATS.constants)


_SUMS = {"+": (operator.add, "to add"), "-": (operator.sub, "to subtract")}


def power(base: SIQuantity, exponent: SIQuantity, mathematics: Mathematics) -> SIQuantity:
    """The power; a base with a unit needs an exponent that is a known number."""
    if not exponent.measures(Dimension.NUMBER):
        raise refusal(f"the exponent {exponent}", "a plain number as exponent")
    value = exponent.magnitude
    known = None if getattr(value, "free_symbols", None) else float(value)
    if known is not None and abs(known) > HIGHEST_POWER:
        raise refusal(
            f"the exponent {known:.6g}", f"an exponent from -{HIGHEST_POWER} to {HIGHEST_POWER}"
        )
    unit = base.units
    if not base.is_bare:
        if known is None:
            raise refusal(
                f"the exponent {value}", "a known number as exponent of a quantity with a unit"
            )
        unit = base.units**known
        if any(abs(p) > HIGHEST_POWER for p in unit.powers):
            raise refusal(f"the unit {unit}", f"powers of units up to {HIGHEST_POWER}")
    return make_quantity(mathematics.functions["pow"](base.magnitude, value), unit)


def apply(name: str, operands: Sequence[SIQuantity], mathematics: Mathematics) -> SIQuantity:
    """The function or operator of that name; one operand of an operator gets its sign."""
    if name in RULES:
        unit = _unit_of_function(name, operands)
        magnitudes = [operand.magnitude for operand in operands]
        return make_quantity(mathematics.functions[name](*magnitudes), unit)
    if len(operands) == 1:
        return make_quantity(-operands[0].magnitude, operands[0].units)
    left, right = operands
    if name == "^":
        return power(left, right, mathematics)
    if name in _SUMS:  # zero goes with anything
        combine, purpose = _SUMS[name]
        unit = _common_unit(operands, purpose)
    else:
        combine = operator.mul if name == "*" else operator.truediv
        unit = combine(left.units, right.units)
    return make_quantity(combine(left.magnitude, right.magnitude), unit)


def in_words(name: str, operands: Sequence[SIQuantity]) -> str:
    """What `apply` does, for messages."""
    words = list(map(str, operands))
    if name in RULES:
        return f"{name} of {', '.join(words)}"
    return f" {'to the power' if name == '^' else name} ".join(words)


_ONE, _ANY = range(1, 2), range(1, 1001)
RULES: Mapping[str, range] = MappingProxyType(
    {
        **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan"), _ONE),
        "atan2": range(2, 3),
        **dict.fromkeys(("sqrt", "abs"), _ONE),
        **dict.fromkeys(("min", "max", "hypot"), _ANY),
    }
)
"""The functions of expressions, with how many arguments they may have."""


def _unit_of_function(name: str, arguments: Sequence[SIQuantity]) -> Unit:
    """Unit of the value, of arguments that fit."""
    first = arguments[0]
    if name == "sqrt":
        return first.units**0.5
    if name in ("sin", "cos", "tan"):
        if not first.units.is_like(Unit()):
            raise refusal(f"{name} of {first}", "an angle, such as 10 deg")
        x = first.magnitude  # whole numbers of radians are hardly meant
        if first.is_bare and isinstance(x, float) and abs(x) > FULL_TURN and x.is_integer():
            warn_of_slip(f"{name}({x:g}): an angle of {x:g} rad; in degrees? write {x:g} deg")
        return Unit()
    if name in ("asin", "acos", "atan"):
        if not first.measures(Dimension.NUMBER):
            raise refusal(f"{name} of {first}", "a plain number")
        return make_unit({"rad": 1})
    unit = _common_unit(arguments, f"in {name}")
    return make_unit({"rad": 1}) if name == "atan2" else unit


def _common_unit(arguments: Sequence[SIQuantity], purpose: str) -> Any:
    """The unit that all arguments share; a plain zero fits any, rad counts as a number."""
    weighty = [a for a in arguments if not (a.is_bare and a.magnitude == 0)] or arguments[:1]
    first = weighty[0]
    for other in weighty[1:]:
        if not first.units.is_like(other.units):
            bare = first.is_bare != other.is_bare
            raise refusal(
                f"{first} and {other}",
                f"quantities of one dimension {purpose}",
                "write the plain number with its unit" if bare else None,
            )
        if first.is_bare:
            first = other  # a plain number beside an angle is in rad
    return first.units


_MOST_BITS = 4096  # of a fraction: far more than data need, far less than the memory


@cache
def exact_mathematics() -> Mathematics:
    """The functions of SymPy expressions."""
    import sympy as sp

    def hypot(*values: Any) -> Any:
        return sp.sqrt(sum(value**2 for value in values))

    def number(digits: str, unit: Unit | None) -> SIQuantity:
        # Numbers far below the range of floats would need too much memory.
        return exact_quantity(sp.Rational(digits) if float(digits) else sp.Integer(0), unit)

    def power(base: Any, exponent: Any) -> Any:
        # A parameter is a float in the formula of a coordinate.
        base, exponent = sp.sympify(base), sp.sympify(exponent)
        if exponent.is_Float and float(exponent).is_integer():
            exponent = sp.Integer(int(exponent))  # of a polynomial
        if base.is_Rational and exponent.is_Rational:
            bits = max(int(base.p).bit_length(), int(base.q).bit_length())
            if bits * abs(float(exponent)) > _MOST_BITS:
                got = f"a power of {_MOST_BITS} binary digits or more"
                raise refusal(got, "a number that can be written out")
        return base**exponent

    names = "sin cos tan asin acos atan atan2 sqrt"
    functions = {name: getattr(sp, name) for name in names.split()}
    functions |= {"abs": sp.Abs, "min": sp.Min, "max": sp.Max, "hypot": hypot, "pow": power}
    return Mathematics(
        MappingProxyType(functions),
        MappingProxyType({"pi": sp.pi}),
        is_possible,
        number,
        exact_number,
    )
