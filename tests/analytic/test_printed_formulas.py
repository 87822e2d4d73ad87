"""The formulas of all shipped robots as they are printed, and their symbols.

A change of a formula or of a word shows as a difference from ``printed_formulas.txt``. After a
change that is meant, ``python -m tests.analytic.test_printed_formulas`` writes the file anew.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic.exact.definition import different_entries, operations_of
from robostiff.analytic.export import derivation_text
from robostiff.errors import InputError
from robostiff.io.model_file import ParameterChoice
from tests.analytic.formulas import derived

QUICKEST = {"3-rrr", "delta", "gough-stewart-b", "planar-link", "two-link-arm"}
EVERY_POSE = {"home": rs.AtHome(), "symbolic": rs.AtSymbols()}


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


@pytest.mark.parametrize("pose", EVERY_POSE)
@pytest.mark.parametrize(
    "name",
    [pytest.param(x, marks=[] if x in QUICKEST else pytest.mark.slow) for x in rs.shipped_robots()],
)
def test_a_name_is_one_symbol(name: str, pose: str):
    try:
        derivation = rs.derive(name, pose=EVERY_POSE[pose])
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


PAGE = Path(__file__).parent / "data" / "printed_formulas.txt"
POSES = {"home": rs.AtHome(), "symbolic": rs.AtSymbols()}
QUICK = ("3-rpr", "3-rrr", "delta", "gough-stewart-b", "planar-link", "two-link-arm")
WIDTH = 88


def printed(name, pose):
    """Operations and lines of K and of its names, and the text."""
    try:
        derivation = derived(name, POSES[pose])
    except InputError as error:
        return f"refused\n\n{error}\n"
    own = derivation.named or derivation
    entries = different_entries(own.K.flat())
    lines = len(entries) + sum(1 for d in own.definitions if d.expression.free_symbols)
    count = f"{operations_of(entries, own.definitions)} operations, {lines} lines"
    return f"{count}\n\n{derivation_text(derivation, width=WIDTH)}"


def kept():
    parts = re.split(r"^#### (.*), (home|symbolic): ", PAGE.read_text(encoding="utf-8"), flags=re.M)
    each = zip(parts[1::3], parts[2::3], parts[3::3], strict=True)
    return {(name, pose): text for name, pose, text in each}


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize(
    "name",
    [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in rs.shipped_robots()],
)
def test_the_printed_formula_is_the_one_on_file(name, pose):
    assert printed(name, pose) + "\n" == kept()[name, pose]


if __name__ == "__main__":
    PAGE.write_text(
        "".join(
            f"#### {name}, {pose}: {printed(name, pose)}\n"
            for name in rs.shipped_robots()
            for pose in POSES
        ),
        encoding="utf-8",
    )
