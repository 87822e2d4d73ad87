"""A derivation and its legs as JSON data, and back without loss."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Condition, Definition, Derivation, Stage
from robostiff.analytic.export.derivative_outline import refuse_derivative
from robostiff.analytic.export.entries import entries, rows, symbols_of
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

LEG_KEYS = (
    "name",
    "joints",
    "redundant",
    "elastic",
    "wrenches",
    "compliances",
    "K",
    "definitions",
)


_VERSION = 1
_ROBOT_KEYS = ("legs", "where", "coordinates", "following", "remark", "conditions", "named")
_CONDITION_KEYS = ("words", "expression", "equations")
_NAMED_KEYS = ("K", "legs", "definitions")
_MOST_CHARACTERS = 10_000
_MOST_PARTS = 100_000


def leg_data(leg: LegDerivation) -> dict[str, Any]:
    """A leg as plain data."""
    return {
        "name": leg.name,
        "joints": list(leg.joints),
        "redundant": list(leg.redundant),
        "elastic": list(leg.elastic),
        "wrenches": [_column_data(w) for w in leg.wrenches],
        "compliances": [expression_tree(c) for c in leg.compliances],
        "K": None if leg.K is None else _matrix_data(leg.K),
        "definitions": _definitions_data(leg.definitions),
    }


def leg_from_data(data: dict[str, Any], reader: _DerivationReader) -> LegDerivation:
    """Read a leg, its keys checked before.

    Raises
    ------
    InputError
        When something in it is not what `leg_data` writes.
    """
    wrenches = tuple(reader.column(w) for w in _list(data["wrenches"], "wrenches"))
    compliances = tuple(reader.expression(c) for c in _list(data["compliances"], "compliances"))
    if len(wrenches) != len(compliances):
        raise InputError(
            "compliances of a leg", got=len(compliances), expected=f"one a wrench: {len(wrenches)}"
        )
    return LegDerivation(
        name=texts([data["name"]], "name of a leg")[0],
        joints=texts(data["joints"], "joints"),
        redundant=texts(data["redundant"], "redundant joints"),
        elastic=texts(data["elastic"], "elastic parts"),
        wrenches=wrenches,
        compliances=compliances,
        K=None if data["K"] is None else reader.matrix(data["K"]),
        definitions=reader.definitions(data["definitions"]),
    )


def texts(data: Any, what: str) -> tuple[str, ...]:
    """A list of short texts."""
    found = _list(data, what)
    for text in found:
        if not isinstance(text, str) or len(text) > _MOST_CHARACTERS:
            raise InputError(what, got=shown(text), expected="texts")
    return tuple(found)


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
    data = {
        "robostiff_derivation": _VERSION,
        "name": derivation.name,
        "symbols": [symbol_data(symbol) for symbol in _symbols_by_name(derivation)],
        "K0": _matrix_data(derivation.K0),
        "stages": [
            {
                "joint": stage.joint,
                "rule": stage.rule,
                "J": _column_data(stage.J),
                "u": _column_data(stage.u),
                "mu": expression_tree(stage.mu),
                "K": _matrix_data(stage.K),
                "definitions": _definitions_data(stage.definitions),
            }
            for stage in derivation.stages
        ],
        "K": _matrix_data(derivation.K),
        "definitions": _definitions_data(derivation.definitions),
    }
    if isinstance(derivation, RobotDerivation):
        data["legs"] = [leg_data(leg) for leg in derivation.legs]
        data["where"] = derivation.where
        data["coordinates"] = list(derivation.coordinates)
        data["following"] = list(derivation.following)
        data["remark"] = derivation.remark
        data["conditions"] = [
            {
                "words": condition.words,
                "expression": expression_tree(condition.expression),
                **(
                    {"equations": list(map(expression_tree, condition.equations))}
                    if condition.equations
                    else {}
                ),
            }
            for condition in derivation.conditions
        ]
        data["named"] = None if derivation.named is None else _named_data(derivation.named)
    return data


def _named_data(named: InNames) -> dict[str, Any]:
    return {
        "K": _matrix_data(named.K),
        "legs": [leg_data(leg) for leg in named.legs],
        "definitions": _definitions_data(named.definitions),
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
    keys = ("robostiff_derivation", "name", "symbols", "K0", "stages", "K", "definitions")
    is_robot = isinstance(data, dict) and "legs" in data
    if is_robot:  # absent in older files
        data = {"following": [], "conditions": [], "remark": "", "named": None, **data}
    fields = _fields(data, "derivation", (*keys, *_ROBOT_KEYS) if is_robot else keys)
    if fields["robostiff_derivation"] != _VERSION or fields["robostiff_derivation"] is True:
        raise InputError(
            "version of the derivation", got=shown(fields["robostiff_derivation"]), expected="1"
        )
    symbols = read_symbols(_list(fields["symbols"], "symbols"))
    reader = _DerivationReader(symbols, _size(fields["K"]))
    definitions = reader.definitions(fields["definitions"])
    _check_order(definitions)
    derivation = Derivation(
        name=_text(fields["name"], "name"),
        K0=reader.matrix(fields["K0"]),
        stages=tuple(reader.stage(stage) for stage in _list(fields["stages"], "stages")),
        K=reader.matrix(fields["K"]),
        definitions=definitions,
    )
    return _of_robot(derivation, fields, reader) if is_robot else derivation


def _of_robot(
    derivation: Derivation, fields: dict[str, Any], reader: _DerivationReader
) -> RobotDerivation:
    """The derivation with its legs."""
    return RobotDerivation(
        name=derivation.name,
        K0=derivation.K0,
        stages=derivation.stages,
        K=derivation.K,
        definitions=derivation.definitions,
        legs=_legs(fields["legs"], reader),
        where=_text(fields["where"], "where"),
        coordinates=texts(fields["coordinates"], "coordinates"),
        following=texts(fields["following"], "following"),
        remark=_text(fields["remark"], "remark"),
        conditions=tuple(
            Condition(
                _text(condition["words"], "words"),
                reader.expression(condition["expression"]),
                tuple(map(reader.expression, _list(condition["equations"], "equations"))),
            )
            for condition in (
                _fields({"equations": [], **data}, "condition", _CONDITION_KEYS)
                for data in _list(fields["conditions"], "conditions")
            )
        ),
        named=None if fields["named"] is None else _in_names(fields["named"], reader),
    )


def _legs(data: Any, reader: _DerivationReader) -> tuple[LegDerivation, ...]:
    legs = [_fields(leg, "leg", LEG_KEYS) for leg in _list(data, "legs")]
    return tuple(leg_from_data(leg, reader) for leg in legs)


def _in_names(data: Any, reader: _DerivationReader) -> InNames:
    fields = _fields(data, "form in names", _NAMED_KEYS)
    definitions = reader.definitions(fields["definitions"])
    _check_order(definitions)
    return InNames(reader.matrix(fields["K"]), _legs(fields["legs"], reader), definitions)


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


def _matrix_data(M: sp.ImmutableMatrix) -> list[list[Any]]:
    return [[expression_tree(entry) for entry in row] for row in rows(M)]


def _column_data(column: sp.ImmutableMatrix) -> list[Any]:
    return [expression_tree(entry) for entry in entries(column)]


def _definitions_data(definitions: Iterable[Definition]) -> list[dict[str, Any]]:
    return [
        {"symbol": d.symbol.name, "expression": expression_tree(d.expression)} for d in definitions
    ]


class _DerivationReader:
    """Reads the parts of a derivation of one size."""

    def __init__(self, symbols: Mapping[str, sp.Symbol], size: int) -> None:
        self._symbols = symbols
        self._size = size
        self._trees = TreeReader(symbols)

    def stage(self, data: Any) -> Stage:
        keys = ("joint", "rule", "J", "u", "mu", "K", "definitions")
        fields = _fields(data, "stage", keys)
        return Stage(
            joint=_text(fields["joint"], "joint"),
            J=self.column(fields["J"]),
            rule=_text(fields["rule"], "rule"),
            u=self.column(fields["u"]),
            mu=self.expression(fields["mu"]),
            K=self.matrix(fields["K"]),
            definitions=self.definitions(fields["definitions"]),
        )

    def expression(self, data: Any) -> Any:
        return self._trees.expression(data)

    def matrix(self, data: Any) -> sp.ImmutableMatrix:
        rows = [self._entries(row) for row in _list(data, "matrix", self._size)]
        return sp.ImmutableMatrix(rows)

    def column(self, data: Any) -> sp.ImmutableMatrix:
        return sp.ImmutableMatrix(self._size, 1, self._entries(data))

    def definitions(self, data: Any) -> tuple[Definition, ...]:
        return tuple(self._definition(entry) for entry in _list(data, "definitions"))

    def _definition(self, data: Any) -> Definition:
        fields = _fields(data, "definition", ("symbol", "expression"))
        name = _text(fields["symbol"], "symbol")
        if name not in self._symbols:
            raise InputError("symbol", got=shown(name), expected="one of those that are listed")
        return Definition(self._symbols[name], self._trees.expression(fields["expression"]))

    def _entries(self, data: Any) -> list[sp.Expr]:
        return [self._trees.expression(tree) for tree in _list(data, "row", self._size)]


def _check_order(definitions: tuple[Definition, ...]) -> None:
    """Each definition uses given symbols and those defined before it."""
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


def _size(K: Any) -> int:
    size = len(_list(K, "K"))
    return Space.of_size(size).size


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
