"""Symbols and what is assumed of them, as JSON data."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.facts import InconsistentAssumptions

from robostiff.analytic.export.json_shown import shown
from robostiff.errors import InputError

# What may be assumed, the more telling first.
_ASSUMPTIONS = (
    "positive",
    "negative",
    "nonnegative",
    "nonpositive",
    "zero",
    "nonzero",
    "even",
    "odd",
    "prime",
    "composite",
    "integer",
    "noninteger",
    "rational",
    "irrational",
    "algebraic",
    "transcendental",
    "extended_positive",
    "extended_negative",
    "extended_nonnegative",
    "extended_nonpositive",
    "extended_nonzero",
    "real",
    "imaginary",
    "complex",
    "extended_real",
    "hermitian",
    "antihermitian",
    "finite",
    "infinite",
)
_MOST_CHARACTERS = 200
_MOST_SYMBOLS = 20_000


def symbol_data(symbol: sp.Symbol) -> dict[str, Any]:
    """A symbol as plain data, with as few assumptions as say everything.

    Raises
    ------
    InputError
        When it is no plain symbol: it does not commute, or is a dummy.

    Examples
    --------
    >>> symbol_data(sp.Symbol("n", integer=True, positive=True))
    {'name': 'n', 'assumptions': {'integer': True, 'positive': True}}
    """
    if isinstance(symbol, sp.Dummy) or not symbol.is_commutative:
        raise InputError("symbol", got=str(symbol), expected="a plain symbol that commutes")
    if not symbol.name or len(symbol.name) > _MOST_CHARACTERS:
        raise InputError("symbol", got=symbol.name, expected=f"1 to {_MOST_CHARACTERS} letters")
    known = symbol.assumptions0
    needed = {name: known[name] for name in reversed(_ASSUMPTIONS) if name in known}
    # What follows from the rest is left out; what is false goes first.
    for name in sorted(needed, key=lambda name: needed[name]):
        fewer = {other: value for other, value in needed.items() if other != name}
        if sp.Symbol(symbol.name, **fewer) == symbol:
            needed = fewer
    return {"name": symbol.name, "assumptions": dict(sorted(needed.items()))}


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
            expected="some that agree",
        ) from None
