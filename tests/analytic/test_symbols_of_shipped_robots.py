"""One symbol object a name: at all levels of the derivations of shipped robots in symbols."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import pytest
import sympy as sp

import robostiff as rs
from robostiff.errors import InputError
from robostiff.io.model_file import ParameterChoice

QUICK = {"3-rrr", "delta", "gough-stewart-b", "planar-link", "two-link-arm"}
POSES = {"home": rs.AtHome(), "symbolic": rs.AtSymbols()}


def symbols_in(part: Any) -> Iterator[Any]:
    """Symbols of all that can be read off a derivation, at all of its levels."""
    if isinstance(part, sp.Basic | sp.MatrixBase):
        yield from part.free_symbols
    elif is_dataclass(part):
        for own in fields(part):
            yield from symbols_in(getattr(part, own.name))
    elif isinstance(part, dict | tuple | list):
        for own in part.values() if isinstance(part, dict) else part:
            yield from symbols_in(own)


def alike(derivation: Any) -> dict[str, set[sp.Symbol]]:
    """Names that are those of several symbols, which SymPy tells apart by their assumptions."""
    found: dict[str, set[sp.Symbol]] = defaultdict(set)
    for symbol in symbols_in(derivation):
        found[symbol.name].add(symbol)
    assert found or not derivation.symbols  # of numbers alone
    return {name: own for name, own in found.items() if len(own) > 1}


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize(
    "name",
    [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in rs.shipped_robots()],
)
def test_a_name_is_one_symbol(name: str, pose: str):
    try:
        derivation = rs.derive(name, pose=POSES[pose])
    except InputError:
        pytest.skip("no closed form of its legs")
    assert not alike(derivation)


@pytest.mark.parametrize("name", ["scara", "two-link-arm", "3-rrr"])
def test_a_name_is_one_symbol_in_joint_coordinates(name: str):
    robot = rs.load(name, symbols=ParameterChoice.ALL)
    assert not alike(rs.derive(robot, pose=rs.AtJoints()))


def test_two_symbols_of_a_name_are_found():
    x, positive = sp.Symbol("x"), sp.Symbol("x", positive=True)
    assert alike((sp.Matrix([x]), {"c_i": (positive,)})) == {"x": {x, positive}}
