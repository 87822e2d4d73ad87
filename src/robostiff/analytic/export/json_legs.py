"""Legs of a robot's derivation as JSON data, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import sympy as sp

from robostiff.analytic.derivation import Definition
from robostiff.analytic.export.entries import entries, rows
from robostiff.analytic.export.json_expression import expression_tree
from robostiff.analytic.export.json_shown import shown
from robostiff.analytic.robot_derivation import LegDerivation
from robostiff.errors import InputError

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


class PartReader(Protocol):
    """What reads matrices, columns, expressions and definitions of one size."""

    def matrix(self, data: Any) -> sp.ImmutableMatrix:
        """An (n, n) matrix."""
        ...

    def column(self, data: Any) -> sp.ImmutableMatrix:
        """An (n, 1) column."""
        ...

    def expression(self, data: Any) -> Any:
        """An expression."""
        ...

    def definitions(self, data: Any) -> tuple[Definition, ...]:
        """Definitions in order."""
        ...


def leg_data(
    leg: LegDerivation, definitions_data: Callable[[Sequence[Definition]], Any]
) -> dict[str, Any]:
    """A leg as plain data."""
    return {
        "name": leg.name,
        "joints": list(leg.joints),
        "redundant": list(leg.redundant),
        "elastic": list(leg.elastic),
        "wrenches": [[expression_tree(x) for x in entries(w)] for w in leg.wrenches],
        "compliances": [expression_tree(c) for c in leg.compliances],
        "K": None if leg.K is None else [[expression_tree(x) for x in row] for row in rows(leg.K)],
        "definitions": definitions_data(leg.definitions),
    }


def leg_from_data(data: dict[str, Any], reader: PartReader) -> LegDerivation:
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


_MOST_CHARACTERS = 10_000
_MOST_PARTS = 100_000


def _list(data: Any, what: str) -> list[Any]:
    if not isinstance(data, list) or len(data) > _MOST_PARTS:
        raise InputError(what, got=shown(data), expected="a list")
    return data
