"""Expressions as small trees of lists, numbers as text: ``["*", ["rat", "1", "2"], ["sym", "L"]]``.

Reading evaluates no text: a tree that is not an expression of the vocabulary is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import sympy as sp
from sympy.core.assumptions import _assume_defined
from sympy.core.facts import InconsistentAssumptions

from robostiff.analytic.export.vocabulary import (
    CONSTANTS,
    FUNCTIONS,
    constant_name,
    function_name,
    is_exponent,
    unknown,
)
from robostiff.errors import InputError


def shown(data: Any) -> str:
    """A text or number for an error message; for other data only the kind."""
    if isinstance(data, str):
        return data[:80]
    if data is None or isinstance(data, bool | float):
        return str(data)
    if isinstance(data, int):
        return str(data) if abs(data) < 10**30 else "a very large integer"
    if isinstance(data, list) and data and isinstance(data[0], str):
        return f"list that starts with {data[0][:80]!r}"
    return type(data).__name__


MOST_NODES = 2_000_000
DEEPEST = 200
_MOST_DIGITS = 2000
_MOST_BITS = 100_000

_ARGUMENTS = {"atan2": 2}
_SUMS = {"+": sp.Add, "*": sp.Mul}


def expression_tree(expression: sp.Basic, depth: int = 0) -> list[Any]:
    """Write an expression as a tree.

    Raises
    ------
    InputError
        For what is not of the vocabulary, or is too deep.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> expression_tree(sp.sin(x) / 2)
    ['*', ['rat', '1', '2'], ['fn', 'sin', ['sym', 'x']]]
    """
    if depth > DEEPEST:
        raise _too_deep()
    if not expression.args:
        return _leaf(expression)
    arguments = [expression_tree(argument, depth + 1) for argument in expression.args]
    for symbol, kind in _SUMS.items():
        if isinstance(expression, kind):
            return [symbol, *arguments]
    if isinstance(expression, sp.Pow) and is_exponent(expression.exp):
        return ["^", *arguments]
    name = function_name(expression)
    if name is None:
        raise unknown(expression)
    return ["fn", name, *arguments]


def _leaf(expression: sp.Basic) -> list[Any]:
    if isinstance(expression, sp.Symbol) and not isinstance(expression, sp.Dummy):
        return ["sym", expression.name]
    if isinstance(expression, sp.Rational) and expression.is_finite:
        return ["rat", str(int(expression.p)), str(int(expression.q))]
    if isinstance(expression, sp.Float) and expression.is_finite:
        sign, mantissa, exponent, _ = expression._mpf_
        signed = -int(mantissa) if sign else int(mantissa)
        return ["float", str(signed), int(exponent), int(expression._prec)]
    name = constant_name(expression)
    if name is None:
        raise unknown(expression)
    return ["const", name]


class TreeReader:
    """Reads trees back into expressions, all of them together within one limit of size.

    `symbols`: the symbols that may occur.

    Examples
    --------
    >>> x = sp.Symbol("x", positive=True)
    >>> reader = TreeReader({"x": x})
    >>> reader.expression(["*", ["rat", "1", "2"], ["fn", "sin", ["sym", "x"]]])
    sin(x)/2
    >>> reader.expression(["fn", "eval", ["sym", "x"]])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    robostiff.errors.InputError: function: got 'eval', expected one of abs, acos, ...
    """

    def __init__(self, symbols: Mapping[str, sp.Symbol]) -> None:
        self._symbols = symbols
        self._nodes = 0

    def expression(self, tree: Any, depth: int = 0) -> sp.Expr:
        """Read a tree.

        Raises
        ------
        InputError
            When it is not an expression, is too deep, or all are too large together.
        """
        self._nodes += 1
        if self._nodes > MOST_NODES:
            raise InputError("formulas", expected=f"at most {MOST_NODES} symbols and operations")
        if depth > DEEPEST:
            raise _too_deep()
        if not isinstance(tree, list) or not tree or not isinstance(tree[0], str):
            raise InputError("expression", got=shown(tree), expected='a list such as ["sym", "L"]')
        if tree[0] in {"sym", "rat", "float", "const"}:
            return self._leaf(tree)
        match tree:
            case ["+" | "*" as kind, _, _, *_]:
                arguments = [self.expression(argument, depth + 1) for argument in tree[1:]]
                return _SUMS[kind](*arguments, evaluate=False)
            case ["^", base, exponent]:
                power = self.expression(exponent, depth + 1)
                if not is_exponent(power):
                    raise InputError(
                        "exponent", got=shown(exponent), expected="a small rational number"
                    )
                return sp.Pow(self.expression(base, depth + 1), power, evaluate=False)
            case ["fn", str(name), *given]:
                return self._function(name, given, depth)
        raise InputError(
            "expression", got=shown(tree), expected="a sum, product, power, function, ..."
        )

    def _leaf(self, tree: list[Any]) -> sp.Expr:
        match tree:
            case ["sym", str(name)] if name in self._symbols:
                return self._symbols[name]
            case ["rat", str(numerator), str(denominator)]:
                return _rational(numerator, denominator)
            case ["float", str(mantissa), int(exponent), int(bits)]:
                return _float(mantissa, exponent, bits)
            case ["const", str(name)] if name in CONSTANTS:
                return CONSTANTS[name]
            case ["sym", name]:
                raise InputError("symbol", got=shown(name), expected="one of those that are listed")
        raise InputError("expression", got=shown(tree), expected="a symbol or number")

    def _function(self, name: str, given: list[Any], depth: int) -> sp.Expr:
        if name not in FUNCTIONS:
            raise InputError("function", got=shown(name), expected=f"one of {', '.join(FUNCTIONS)}")
        wanted = _ARGUMENTS.get(name, 1)
        if len(given) != wanted:
            raise InputError(f"arguments of {name}", got=len(given), expected=str(wanted))
        arguments = [self.expression(argument, depth + 1) for argument in given]
        return FUNCTIONS[name](*arguments, evaluate=False)


def _rational(numerator: str, denominator: str) -> sp.Expr:
    p, q = _integer(numerator), _integer(denominator)
    if q < 1 or math.gcd(p, q) != 1:
        raise InputError("number", got=shown(f"{p}/{q}"), expected="a reduced fraction")
    return sp.Rational(p, q)


def _float(mantissa: str, exponent: int, bits: int) -> sp.Float:
    value = _integer(mantissa)
    is_number = not isinstance(exponent, bool) and not isinstance(bits, bool)
    if not is_number or abs(exponent) > _MOST_BITS or not 1 <= bits <= _MOST_BITS:
        raise InputError("exponent of a float", got=shown(exponent), expected="a finite number")
    if value.bit_length() > bits:
        raise InputError("mantissa", got=shown(mantissa), expected=f"at most {bits} bits")
    sign = int(value < 0)
    return sp.Float((sign, abs(value), exponent, abs(value).bit_length()), precision=bits)


def _integer(text: str) -> int:
    if len(text) > _MOST_DIGITS or not re.fullmatch(r"-?[0-9]+", text, re.ASCII):
        raise InputError("integer", got=shown(text), expected=f"at most {_MOST_DIGITS} digits")
    return int(text)


def _too_deep() -> InputError:
    return InputError("expression", expected=f"at most {DEEPEST} operations inside one another")


_ASSUMPTIONS = sorted(_assume_defined - {"commutative", "polar"})
_MOST_CHARACTERS = 200
_MOST_SYMBOLS = 20_000


def symbol_data(symbol: sp.Symbol) -> dict[str, Any]:
    """A symbol as plain data, with the assumptions that were given."""
    if isinstance(symbol, sp.Dummy) or not symbol.is_commutative:
        raise InputError("symbol", got=str(symbol), expected="a plain symbol that commutes")
    if not symbol.name or len(symbol.name) > _MOST_CHARACTERS:
        raise InputError("symbol", got=symbol.name, expected=f"1 to {_MOST_CHARACTERS} letters")
    given = symbol._assumptions_orig  # of a renamed symbol also that it is commutative
    return {"name": symbol.name, "assumptions": {x: given[x] for x in _ASSUMPTIONS if x in given}}


def read_symbols(data: list[Any]) -> dict[str, sp.Symbol]:
    """Symbols by name.

    Raises
    ------
    InputError
        For anything but names with known assumptions, each name once.

    Examples
    --------
    >>> read_symbols([{"name": "L", "assumptions": {"positive": True}}])["L"].is_positive
    True
    """
    if len(data) > _MOST_SYMBOLS:
        raise InputError("symbols", got=len(data), expected=f"at most {_MOST_SYMBOLS}")
    symbols: dict[str, sp.Symbol] = {}
    for entry in data:
        symbol = _read_symbol(entry)
        if symbol.name in symbols:
            raise InputError("symbols", got=symbol.name, expected="each name once")
        symbols[symbol.name] = symbol
    return symbols


def _read_symbol(data: Any) -> sp.Symbol:
    match data:
        case {"name": str(name), "assumptions": dict(assumptions)} if len(data) == 2:
            pass
        case _:
            raise InputError(
                "symbol", got=shown(data), expected="an object with name and assumptions"
            )
    if not 1 <= len(name) <= _MOST_CHARACTERS:
        raise InputError("symbol", got=shown(name), expected=f"1 to {_MOST_CHARACTERS} letters")
    for assumption, value in assumptions.items():
        if assumption not in _ASSUMPTIONS or not isinstance(value, bool):
            raise InputError(
                f"assumption of {name!r}",
                got=f"{shown(assumption)}: {shown(value)}",
                expected="true or false for one of " + ", ".join(_ASSUMPTIONS),
            )
    try:
        return sp.Symbol(name, **assumptions)
    except InconsistentAssumptions:
        raise InputError(
            f"assumptions of {name!r}",
            got=shown(", ".join(assumptions)),
            expected="consistent assumptions",
        ) from None
