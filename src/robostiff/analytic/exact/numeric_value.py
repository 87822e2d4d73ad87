"""Values of formulas in floats, and with more digits where floats do not suffice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, cast

import flint
import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.errors import InputError

#: Precision of balls, some ninety digits.
BITS = 300

_FUNCTIONS = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "Abs": np.abs,
    "exp": np.exp,
    "log": np.log,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
}


def values_of(
    expressions: Iterable[Any],
    values: Mapping[Any, Any],
    definitions: Iterable[Definition] = (),
    *,
    careful: bool = False,
) -> list[Any]:
    """Values of expressions, of definitions one after the other; not a number where there is none.

    `values`: mapping of symbols to floats, or to arrays of them; `definitions`: steps that the
    expressions need, in order; `careful`: by balls of `BITS`, for numbers only; this avoids
    cancellation in floats.
    """
    if careful:
        with flint.ctx.workprec(BITS):
            return [float(x) for x in balls_of(expressions, values, definitions)]
    known: dict[Any, Any] = {
        symbol: value if isinstance(value, np.ndarray) else float(value)
        for symbol, value in values.items()
    }
    with np.errstate(all="ignore"):
        return _values(expressions, known, definitions, float, _in_floats)


def balls_of(
    expressions: Iterable[Any],
    values: Mapping[Any, Any],
    definitions: Iterable[Definition] = (),
) -> list[Any]:
    """Values as balls of FLINT that contain them, at its precision; given values are exact."""
    known = {symbol: _ball(value) for symbol, value in values.items()}
    return _values(expressions, known, definitions, _ball, _in_balls)


def matrix_value(
    K: Any, values: Mapping[Any, Any], definitions: Iterable[Definition], *, careful: bool = False
) -> np.ndarray:
    """A symmetric matrix of formulas as numbers (..., n, n), see `values_of`."""
    n, entries = K.rows, K.flat()
    places = [(i, j) for i in range(n) for j in range(i, n)]
    upper = [entries[i * n + j] for i, j in places]
    found = values_of(upper, values, definitions, careful=careful)
    matrix = np.zeros((*np.broadcast_shapes(*map(np.shape, values.values())), n, n))
    for (i, j), value in zip(places, found, strict=True):
        matrix[..., i, j] = matrix[..., j, i] = value
    return matrix


def _values(
    expressions: Iterable[Any],
    known: dict[Any, Any],
    definitions: Iterable[Definition],
    number: Callable[[Any], Any],
    compute: Callable[[Any, list[Any]], Any],
) -> list[Any]:
    for definition in definitions:
        known[definition.symbol] = _value(definition.expression, known, number, compute)
    return [_value(expression, known, number, compute) for expression in expressions]


def _value(
    expression: Any,
    known: dict[Any, Any],
    number: Callable[[Any], Any],
    compute: Callable[[Any, list[Any]], Any],
) -> Any:
    found = known.get(expression)
    if found is not None:
        return found
    if expression.is_Number or not expression.args:
        if expression.is_Symbol:
            raise InputError("values of symbols", got=f"none for {expression}")
        value = number(expression)
    else:
        arguments = [_value(part, known, number, compute) for part in expression.args]
        value = compute(expression, arguments)
    known[expression] = value
    return value


def _in_floats(expression: Any, arguments: list[Any]) -> Any:
    if expression.is_Add:
        return sum(arguments[1:], arguments[0])
    if expression.is_Mul:
        product = arguments[0]
        for factor in arguments[1:]:
            product = product * factor
        return product
    if expression.is_Pow:
        base, exponent = np.asarray(arguments[0], dtype=float), expression.exp
        if exponent == sp.Rational(1, 2):
            return np.sqrt(base)[()]
        if exponent.is_Integer:
            return np.power(base, float(exponent))[()]
        return np.power(base, arguments[1])[()]
    function = _FUNCTIONS.get(type(expression).__name__)
    if function is None:
        raise InputError("formula", got=str(expression), expected="functions that have a value")
    return function(*arguments)


def _ball(number: Any) -> Any:
    if number is sp.pi:
        return flint.arb.pi()
    known = sp.sympify(number)
    if not known.is_Number:  # such as E
        known = sp.N(known, BITS)
    exact = cast("sp.Rational", sp.Rational(known))  # finite
    return flint.arb(flint.fmpq(int(exact.p), int(exact.q)))


def _in_balls(expression: Any, arguments: list[Any]) -> Any:
    if expression.is_Add or expression.is_Mul:
        total = arguments[0]
        for other in arguments[1:]:
            total = total + other if expression.is_Add else total * other
        return total
    if expression.is_Pow:
        base, exponent = arguments[0], expression.exp
        if exponent.is_Rational and exponent.q == 2:
            return base.sqrt() ** int(exponent.p)
        return base ** int(exponent) if exponent.is_Integer else base ** arguments[1]
    name = type(expression).__name__
    return abs(*arguments) if name == "Abs" else getattr(flint.arb, name)(*arguments)
