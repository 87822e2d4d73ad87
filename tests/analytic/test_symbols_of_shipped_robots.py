"""One symbol object a name: in K, steps, conditions and legs of shipped robots in symbols."""

from collections import defaultdict
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
import sympy as sp

import robostiff as rs
from robostiff.io.model_file import ParameterChoice

# Those whose formulas in all parameters take seconds, or have steps.
IN_SYMBOLS = {
    "3-rrr",
    "delta",
    "gough-stewart-b",
    "hexapod",
    "planar-link",
    "two-link-arm",
}


def expressions_of(derivation: Any) -> Iterator[Any]:
    """All that can be read off a derivation."""
    yield from derivation.K
    yield from derivation.symbols
    for own in (*derivation.conditions, *derivation.definitions):
        yield own.expression
        yield getattr(own, "symbol", sp.S.Zero)
    for leg in derivation.legs:
        yield from () if leg.K is None else leg.K
    named = derivation.named
    if named is not None:
        yield from named.in_lengths[0]
        yield from (own for own in named.in_lengths[1:] if isinstance(own, sp.Basic))


def alike(derivation: Any) -> dict[str, set[sp.Symbol]]:
    """Names that are those of several symbols, which SymPy tells apart by their assumptions."""
    found: dict[str, set[sp.Symbol]] = defaultdict(set)
    for expression in expressions_of(derivation):
        for symbol in sp.sympify(expression).free_symbols:
            found[symbol.name].add(symbol)
    assert found
    return {name: own for name, own in found.items() if len(own) > 1}


@pytest.mark.parametrize("name", sorted(IN_SYMBOLS))
def test_a_name_is_one_symbol(name: str):
    robot = rs.load(name, symbols=ParameterChoice.ALL)
    assert not alike(rs.derive(robot))


@pytest.mark.parametrize("name", ["scara", "two-link-arm", "3-rrr"])
def test_a_name_is_one_symbol_in_joint_coordinates(name: str):
    robot = rs.load(name, symbols=ParameterChoice.ALL)
    assert not alike(rs.derive(robot, pose=rs.AtJoints()))


def test_two_symbols_of_a_name_are_found():
    x, positive = sp.Symbol("x"), sp.Symbol("x", positive=True)
    fake = SimpleNamespace(
        K=sp.Matrix([x]), symbols=(positive,), conditions=(), definitions=(), legs=(), named=None
    )
    assert alike(fake) == {"x": {x, positive}}
