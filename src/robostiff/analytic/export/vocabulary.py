"""The functions and numbers that an exported formula may contain."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp

from robostiff.errors import InputError

#: Functions by the name under which they are written.
FUNCTIONS: dict[str, Any] = {
    "abs": sp.Abs,
    "acos": sp.acos,
    "asin": sp.asin,
    "atan": sp.atan,
    "atan2": sp.atan2,
    "cos": sp.cos,
    "cosh": sp.cosh,
    "exp": sp.exp,
    "log": sp.log,
    "sin": sp.sin,
    "sinh": sp.sinh,
    "tan": sp.tan,
    "tanh": sp.tanh,
}

#: Numbers that have a name.
CONSTANTS: dict[str, Any] = {"pi": sp.pi, "e": sp.E}

#: Largest numerator and denominator of an exponent.
LARGEST_EXPONENT = 1000

_FUNCTION_NAMES = {function: name for name, function in FUNCTIONS.items()}
_CONSTANT_NAMES = {constant: name for name, constant in CONSTANTS.items()}


def function_name(expression: sp.Basic) -> str | None:
    """Name of the outermost function of an expression; None for other expressions."""
    return _FUNCTION_NAMES.get(expression.func)


def constant_name(expression: sp.Basic) -> str | None:
    """Name of a constant; None for other expressions."""
    return _CONSTANT_NAMES.get(expression)


def is_exponent(number: sp.Basic) -> bool:
    """Whether it is a rational number of a size that occurs in formulas."""
    return isinstance(number, sp.Rational) and (
        abs(int(number.p)) <= LARGEST_EXPONENT and int(number.q) <= LARGEST_EXPONENT
    )


def check_vocabulary(expressions: Iterable[sp.Basic]) -> None:
    """Refuse expressions that cannot be written in another language.

    Raises
    ------
    InputError
        For a function, number or power that is not of the vocabulary.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> check_vocabulary([sp.sqrt(x) / 3, sp.sin(x)])
    >>> check_vocabulary([sp.gamma(x)])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    robostiff.errors.InputError: formula: got 'gamma(x)', expected sums, products, ...
    """
    for expression in expressions:
        for part in sp.preorder_traversal(expression):
            if not _is_known(part):
                raise unknown(part)


def unknown(part: sp.Basic) -> InputError:
    """The error for a part of a formula that is not in the vocabulary."""
    allowed = ", ".join(("sums, products, rational powers", *sorted(CONSTANTS, reverse=True)))
    return InputError("formula", got=str(part), expected=f"{allowed}, {', '.join(FUNCTIONS)}")


def _is_known(part: sp.Basic) -> bool:
    if isinstance(part, sp.Pow):
        return is_exponent(part.exp)
    if isinstance(part, sp.Float):
        return bool(part.is_finite)
    if isinstance(part, sp.Add | sp.Mul | sp.Rational):
        return True  # what is infinite in a sum is a part of its own; to ask SymPy takes minutes
    if isinstance(part, sp.Symbol):
        return not isinstance(part, sp.Dummy)
    return function_name(part) is not None or constant_name(part) is not None
