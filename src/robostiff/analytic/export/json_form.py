"""A derivation and its legs as JSON data, and back without loss.

What each object is made of stands once: a table of its parts, each with how it is written and read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation, Stage
from robostiff.analytic.exact.definition import Condition, Definition
from robostiff.analytic.export.derivative_outline import refuse_derivative
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.json_expression import (
    TreeReader,
    expression_tree,
    read_symbols,
    shown,
    symbol_data,
)
from robostiff.analytic.robot_derivation import InNames, LegDerivation, RobotDerivation
from robostiff.errors import InputError
from robostiff.spatial import Space

_SCHEMA = "robostiff derive 1"
_MOST_CHARACTERS = 10_000
_MOST_PARTS = 100_000


@dataclass(frozen=True)
class _Reader:
    """Reads expressions, and matrices of one size."""

    symbols: Mapping[str, sp.Symbol]
    trees: TreeReader
    size: int

    def row(self, data: Any) -> list[sp.Expr]:
        return [self.trees.expression(tree) for tree in _list(data, "row", self.size)]

    def matrix(self, data: Any) -> sp.ImmutableMatrix:
        return sp.ImmutableMatrix([self.row(row) for row in _list(data, "matrix", self.size)])

    def symbol(self, data: Any) -> sp.Symbol:
        name = _text(data, "symbol")
        if name not in self.symbols:
            raise InputError("symbol", got=shown(name), expected="one of those that are listed")
        return self.symbols[name]


@dataclass(frozen=True)
class _Kind:
    """How a part is written, and read by a reader from data under a name."""

    write: Callable[[Any], Any]
    read: Callable[[_Reader, Any, str], Any]


_TEXT = _Kind(str, lambda _, data, what: _text(data, what))
_SYMBOL = _Kind(lambda symbol: symbol.name, lambda reader, data, _: reader.symbol(data))
_EXPRESSION = _Kind(expression_tree, lambda reader, data, _: reader.trees.expression(data))
_COLUMN = _Kind(
    lambda column: [expression_tree(entry) for entry in column.flat()],
    lambda reader, data, _: sp.ImmutableMatrix(reader.size, 1, reader.row(data)),
)
_MATRIX = _Kind(
    lambda M: [[expression_tree(entry) for entry in row] for row in M.tolist()],
    lambda reader, data, _: reader.matrix(data),
)


def _many(kind: _Kind) -> _Kind:
    return _Kind(
        lambda parts: [kind.write(part) for part in parts],
        lambda reader, data, what: tuple(kind.read(reader, x, what) for x in _list(data, what)),
    )


def _perhaps(kind: _Kind) -> _Kind:
    return _Kind(
        lambda part: None if part is None else kind.write(part),
        lambda reader, data, what: None if data is None else kind.read(reader, data, what),
    )


def _written(whole: Any, parts: Mapping[str, _Kind]) -> dict[str, Any]:
    return {name: kind.write(getattr(whole, name)) for name, kind in parts.items()}


def _read(reader: _Reader, fields: Mapping[str, Any], parts: Mapping[str, _Kind]) -> dict[str, Any]:
    return {name: kind.read(reader, fields[name], name) for name, kind in parts.items()}


def _object(of: Callable[..., Any], what: str, /, **parts: _Kind) -> _Kind:
    def read(reader: _Reader, data: Any, _: str) -> Any:
        return of(**_read(reader, _fields(data, what, tuple(parts)), parts))

    return _Kind(lambda whole: _written(whole, parts), read)


def _leg(**parts: Any) -> LegDerivation:
    wrenches, compliances = parts["wrenches"], parts["compliances"]
    if len(wrenches) != len(compliances):
        raise InputError(
            "compliances of a leg", got=len(compliances), expected=f"one a wrench: {len(wrenches)}"
        )
    return LegDerivation(**parts)


def _in_order(definitions: tuple[Definition, ...]) -> tuple[Definition, ...]:
    """Definitions of which each uses given symbols and those before it."""
    later = {d.symbol for d in definitions}
    if len(later) != len(definitions):
        raise InputError("definitions", got="a name twice", expected="one of each name")
    for definition in definitions:
        early = sorted(str(s) for s in definition.expression.free_symbols & later)
        if early:
            raise InputError(
                f"definition of {definition.symbol.name!r}",
                got=", ".join(early),
                expected="symbols that are given or defined before",
            )
        later.discard(definition.symbol)
    return definitions


_DEFINITIONS = _many(
    _object(Definition, "definition", symbol=_SYMBOL, expression=_EXPRESSION, parts=_many(_TEXT))
)
_ALL_DEFINITIONS = _Kind(_DEFINITIONS.write, lambda *given: _in_order(_DEFINITIONS.read(*given)))
_STAGE = _object(
    Stage,
    "stage",
    joint=_TEXT,
    rule=_TEXT,
    J=_COLUMN,
    u=_COLUMN,
    mu=_EXPRESSION,
    K=_MATRIX,
    definitions=_DEFINITIONS,
)
_LEGS = _many(
    _object(
        _leg,
        "leg",
        name=_TEXT,
        joints=_many(_TEXT),
        redundant=_many(_TEXT),
        elastic=_many(_TEXT),
        wrenches=_many(_COLUMN),
        compliances=_many(_EXPRESSION),
        K=_perhaps(_MATRIX),
        definitions=_DEFINITIONS,
    )
)
_CONDITIONS = _many(
    _object(
        Condition,
        "condition",
        words=_TEXT,
        expression=_EXPRESSION,
        equations=_many(_EXPRESSION),
        leg=_TEXT,
    )
)
_PARTS = {
    "name": _TEXT,
    "K0": _MATRIX,
    "stages": _many(_STAGE),
    "K": _MATRIX,
    "definitions": _ALL_DEFINITIONS,
}


def _meanings(_: _Reader, data: Any, what: str) -> dict[str, str]:
    if not isinstance(data, dict):
        raise InputError(what, got=shown(data), expected="an object")
    return {name: _text(words, f"meaning of {shown(name)}") for name, words in data.items()}


_ROBOT_PARTS = {
    "meanings": _Kind(dict, _meanings),
    "legs": _LEGS,
    "where": _TEXT,
    "coordinates": _many(_TEXT),
    "following": _many(_TEXT),
    "remark": _TEXT,
    "conditions": _CONDITIONS,
    "named": _perhaps(
        _object(InNames, "form in names", K=_MATRIX, legs=_LEGS, definitions=_ALL_DEFINITIONS)
    ),
}


def derivation_data(derivation: Derivation) -> dict[str, Any]:
    """A derivation as plain data, ready for JSON.

    Expressions are trees such as ``["*", ["rat", "1", "2"], ["sym", "L"]]``, matrices lists of
    rows, columns lists. The assumptions of the symbols are kept.

    Parameters
    ----------
    derivation : Derivation

    Raises
    ------
    InputError
        When two symbols have the same name, or an expression is not of the vocabulary.

    Examples
    --------
    >>> k = sp.Symbol("k", positive=True)
    >>> K = sp.ImmutableMatrix(sp.diag(k, k, 0))
    >>> data = derivation_data(Derivation("K_C", K, (), K))
    >>> data["symbols"]
    [{'name': 'k', 'assumptions': {'positive': True}}]
    >>> derivation_from_data(data) == Derivation("K_C", K, (), K)
    True
    """
    refuse_derivative(derivation)
    name, *rest = _PARTS
    return {
        "schema": _SCHEMA,
        name: derivation.name,
        "symbols": [symbol_data(symbol) for symbol in _symbols_by_name(derivation)],
        **_written(derivation, {key: _PARTS[key] for key in rest}),
        **(_written(derivation, _ROBOT_PARTS) if isinstance(derivation, RobotDerivation) else {}),
    }


def derivation_from_data(data: Any) -> Derivation:
    """Read a derivation from plain data, as `derivation_data` wrote it.

    Nothing is evaluated: the expressions are the same as they were, and data from anywhere can do
    no harm.

    Parameters
    ----------
    data : dict

    Raises
    ------
    InputError
        When it is anything else than a derivation.
    """
    is_robot = isinstance(data, dict) and "legs" in data
    parts = {**_PARTS, **_ROBOT_PARTS} if is_robot else _PARTS
    fields = _fields(data, "derivation", ("schema", "symbols", *parts))
    if fields["schema"] != _SCHEMA:
        raise InputError("schema of the derivation", got=shown(fields["schema"]), expected=_SCHEMA)
    symbols = read_symbols(_list(fields["symbols"], "symbols"))
    size = Space.of_size(len(_list(fields["K"], "K"))).size
    read = _read(_Reader(symbols, TreeReader(symbols), size), fields, parts)
    return RobotDerivation(**read) if is_robot else Derivation(**read)


def _symbols_by_name(derivation: Derivation) -> list[sp.Symbol]:
    matrices: list[Any] = [derivation.K0, derivation.K]
    definitions = list(derivation.definitions)
    for stage in derivation.stages:
        matrices += [stage.J, stage.u, stage.K, stage.mu]
        definitions += stage.definitions
    if isinstance(derivation, RobotDerivation):
        legs = list(derivation.legs)
        if (named := derivation.named) is not None:
            matrices.append(named.K)
            definitions += named.definitions
            legs += named.legs
        for leg in legs:
            matrices += [*leg.wrenches, *leg.compliances, *([] if leg.K is None else [leg.K])]
            definitions += leg.definitions
        matrices += [condition.expression for condition in derivation.conditions]
    found = symbols_of([*matrices, *(d.expression for d in definitions)])
    found |= {d.symbol for d in definitions}
    by_name: dict[str, sp.Symbol] = {}
    for symbol in found:
        if symbol.name in by_name:
            raise InputError(
                "symbols", got=f"two called {symbol.name!r}", expected="one of each name"
            )
        by_name[symbol.name] = symbol
    return [by_name[name] for name in sorted(by_name)]


def _fields(data: Any, what: str, keys: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(data, dict) or set(data) != set(keys):
        got = ", ".join(map(shown, data)) if isinstance(data, dict) else shown(data)
        raise InputError(what, got=got, expected=f"an object with {', '.join(keys)}")
    return data


def _list(data: Any, what: str, length: int | None = None) -> list[Any]:
    if not isinstance(data, list) or len(data) > _MOST_PARTS:
        raise InputError(what, got=shown(data), expected="a list")
    if length is not None and len(data) != length:
        raise InputError(what, got=f"{len(data)} entries", expected=str(length))
    return data


def _text(data: Any, what: str) -> str:
    if not isinstance(data, str) or len(data) > _MOST_CHARACTERS:
        raise InputError(what, got=shown(data), expected="a text")
    return data
