"""From SymPy expressions to recorded entries."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import add, mul
from typing import Any

from robostiff.errors import InputError
from robostiff.record import Record, arc_cosine, arc_tangent, cosine, reciprocal, sine, square_root


def entry_reader(record: Record, *, exact: bool) -> Callable[[Any], Any]:
    """A function that writes SymPy expressions as entries of a record.

    Parameters
    ----------
    record : Record
        Has an input for every symbol.
    exact : bool
        Whether SymPy's numbers stay as they are; otherwise they become floats.

    Returns
    -------
    callable
        Takes an expression or a number, and returns an entry or a number.

    Examples
    --------
    >>> import sympy as sp
    >>> R, h = sp.symbols("R h")
    >>> read = entry_reader(Record({"R": [3.0], "h": [4.0]}), exact=False)
    >>> read(sp.sqrt(R**2 + h**2) / 2).sample
    array([2.5])
    """
    known: dict[Any, Any] = {}

    def read(expression: Any) -> Any:
        if not hasattr(expression, "free_symbols"):
            return expression
        if expression not in known:
            known[expression] = _read(expression)
        return known[expression]

    def _read(expression: Any) -> Any:
        if expression.is_number:
            return expression if exact else float(expression)
        if expression.is_Symbol:
            return _input(record, expression.name)
        arguments = [read(argument) for argument in expression.args]
        if expression.is_Pow:
            return _power(expression, arguments[0])
        combine = _FUNCTIONS.get(type(expression).__name__)
        if combine is None:
            raise InputError(
                "formula",
                got=str(expression),
                expected="sums, products, powers, square roots, sin, cos, tan and their inverses",
            )
        return combine(*arguments)

    return read


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "Add": lambda *terms: reduce(add, terms),
    "Mul": lambda *factors: reduce(mul, factors),
    "sin": sine,
    "cos": cosine,
    "tan": lambda angle: sine(angle) * reciprocal(cosine(angle)),
    "atan2": arc_tangent,
    "atan": lambda slope: arc_tangent(slope, 1),
    "acos": arc_cosine,
    "asin": lambda y: arc_tangent(y, square_root(1 - y * y)),
}


def _input(record: Record, name: str) -> Any:
    if name not in record.inputs:
        raise InputError("symbol", got=name, expected=", ".join(record.inputs) or "none")
    return record.input(name)


def _power(expression: Any, base: Any) -> Any:
    exponent = expression.exp
    if exponent.is_Integer:
        return base ** int(exponent)
    if exponent.is_Rational and exponent.q == 2:
        return square_root(base) ** int(exponent.p)
    raise InputError("power", got=str(expression), expected="a whole or half exponent")
