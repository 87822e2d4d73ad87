"""Operators and functions on quantities: their units, and a table of functions on numbers.

Every rule takes quantities apart into magnitude and unit. The magnitudes are combined by a
`Mathematics`, a table of functions of one kind of magnitude: `FLOATS` now, another table for exact
symbols.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

from robostiff.io.suggest import Words
from robostiff.io.units import (
    SIQuantity,
    Unit,
    describe,
    is_bare,
    is_number,
    make_quantity,
    make_unit,
    same_dimension,
)

HIGHEST_POWER = 64


class Refusal(Exception):
    """An operation that makes no sense for its operands; evaluation adds the place."""

    got: Words
    expected: str
    hint: str | None

    def __init__(self, got: str, expected: str, hint: str | None = None) -> None:
        super().__init__(got, expected, hint)
        self.got, self.expected, self.hint = Words(got), expected, hint


@dataclass(frozen=True)
class Mathematics:
    """The functions of one kind of magnitude.

    Parameters
    ----------
    functions : mapping of str to callable
        Of magnitudes: ``pow`` and every name in `RULES`. They may raise ArithmeticError or
        ValueError where they have no value.
    constants : mapping of str to magnitude
        ``pi``.
    is_finite : callable
        Whether a magnitude can be used as a result.
    number : callable, optional
        The quantity of decimal digits and a unit; left out, that of the nearest float.
    bare : callable
        The magnitude of a plain number.
    """

    functions: Mapping[str, Callable[..., Any]]
    constants: Mapping[str, Any]
    is_finite: Callable[[Any], bool]
    number: Callable[[str, Unit | None], SIQuantity] | None = None
    bare: Callable[[float], Any] = float


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


def _of_alike(
    combine: Callable[[Any, Any], Any], purpose: str, left: SIQuantity, right: SIQuantity
) -> SIQuantity:
    """Sum or difference; zero goes with anything."""
    unit = _common_unit((left, right), purpose)
    return make_quantity(combine(left.magnitude, right.magnitude), unit)


def _of_any(combine: Callable[[Any, Any], Any], left: SIQuantity, right: SIQuantity) -> SIQuantity:
    magnitude = combine(left.magnitude, right.magnitude)
    return make_quantity(magnitude, combine(left.units, right.units))


OPERATORS: Mapping[str, Callable[[SIQuantity, SIQuantity], SIQuantity]] = MappingProxyType(
    {
        "+": partial(_of_alike, operator.add, "to add"),
        "-": partial(_of_alike, operator.sub, "to subtract"),
        "*": partial(_of_any, operator.mul),
        "/": partial(_of_any, operator.truediv),
    }
)


def power(base: SIQuantity, exponent: SIQuantity, mathematics: Mathematics) -> SIQuantity:
    """The power; a base with a unit needs an exponent that is a known number."""
    if not is_number(exponent):
        raise Refusal(f"the exponent {describe(exponent)}", "a plain number as exponent")
    value = exponent.magnitude
    known = None if getattr(value, "free_symbols", None) else float(value)
    if known is not None and abs(known) > HIGHEST_POWER:
        raise Refusal(
            f"the exponent {known:.6g}", f"an exponent from -{HIGHEST_POWER} to {HIGHEST_POWER}"
        )
    unit = base.units
    if not is_bare(base):
        if known is None:
            raise Refusal(
                f"the exponent {value}", "a known number as exponent of a quantity with a unit"
            )
        unit = base.units**known
        if any(abs(p) > HIGHEST_POWER for p in unit.powers):
            raise Refusal(f"the unit {unit}", f"powers of units up to {HIGHEST_POWER}")
    return make_quantity(mathematics.functions["pow"](base.magnitude, value), unit)


@dataclass(frozen=True)
class Rule:
    """Number of arguments of a function, and unit of its value.

    `unit` gets the arguments and the name of the function, and may refuse.
    """

    unit: Callable[[Sequence[SIQuantity], str], Any]
    fewest: int = 1
    most: int = 1


def apply(name: str, operands: Sequence[SIQuantity], mathematics: Mathematics) -> SIQuantity:
    """The function or operator of that name; one operand of an operator gets its sign."""
    if name in RULES:
        unit = RULES[name].unit(operands, name)
        magnitudes = [operand.magnitude for operand in operands]
        return make_quantity(mathematics.functions[name](*magnitudes), unit)
    if len(operands) == 1:
        return make_quantity(-operands[0].magnitude, operands[0].units)
    left, right = operands
    return power(left, right, mathematics) if name == "^" else OPERATORS[name](left, right)


def in_words(name: str, operands: Sequence[SIQuantity]) -> str:
    """What `apply` does, for messages."""
    words = [describe(operand) for operand in operands]
    if name in RULES:
        return f"{name} of {', '.join(words)}"
    return f" {'to the power' if name == '^' else name} ".join(words)


def _of_angle(arguments: Sequence[SIQuantity], name: str) -> Any:
    (argument,) = arguments
    if not same_dimension(argument, make_quantity(0.0)):
        raise Refusal(f"{name} of {describe(argument)}", "an angle, such as 10 deg")
    return make_unit({})


def _to_angle(arguments: Sequence[SIQuantity], name: str) -> Any:
    (argument,) = arguments
    if not is_number(argument):
        raise Refusal(f"{name} of {describe(argument)}", "a plain number")
    return make_unit({"rad": 1})


def _alike(arguments: Sequence[SIQuantity], name: str) -> Any:
    return _common_unit(arguments, f"in {name}")


def _alike_to_angle(arguments: Sequence[SIQuantity], name: str) -> Any:
    _alike(arguments, name)
    return make_unit({"rad": 1})


_MANY = 1000

RULES: Mapping[str, Rule] = MappingProxyType(
    {
        **dict.fromkeys(("sin", "cos", "tan"), Rule(_of_angle)),
        **dict.fromkeys(("asin", "acos", "atan"), Rule(_to_angle)),
        "atan2": Rule(_alike_to_angle, 2, 2),
        "sqrt": Rule(lambda arguments, _: arguments[0].units ** 0.5),
        "abs": Rule(_alike),
        **dict.fromkeys(("min", "max", "hypot"), Rule(_alike, 1, _MANY)),
    }
)
"""The functions of expressions."""


def _common_unit(arguments: Sequence[SIQuantity], purpose: str) -> Any:
    """The unit that all arguments share; a plain zero fits any, rad counts as a number."""
    weighty = [a for a in arguments if not (is_bare(a) and a.magnitude == 0)] or arguments[:1]
    first = weighty[0]
    for other in weighty[1:]:
        if not same_dimension(first, other):
            bare = is_bare(first) != is_bare(other)
            raise Refusal(
                f"{describe(first)} and {describe(other)}",
                f"quantities of one dimension {purpose}",
                "write the plain number with its unit" if bare else None,
            )
        if is_bare(first):
            first = other  # a plain number beside an angle is in rad
    return first.units
