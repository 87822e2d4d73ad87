"""Parallel blocks in model files and snapshots: what may be written, and what becomes of it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
from robostiff.errors import FileError
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.io.snapshot import snapshot_from_document, snapshot_schema, snapshot_to_data
from robostiff.model import ParallelBlock, PlacedBlock, Snapshot
from tests.cases.metric import distance

BAR = """\
              - {type: revolute, name: near pin, axis: z, role: passive}
              - {type: beam, to: [300 mm, 0, 0], material: steel, section: {circle: {diameter: d}}}
              - {type: revolute, axis: z, role: passive}
"""
HEAD = """\
robostiff: 1
name: demo
source: a test
home: {at: [300 mm, 0, 0]}
coordinates: [y]
parameters: {d: 9 mm}
legs:
  - name: leg
    chain:
"""
PARALLEL = f"""{HEAD}\
      - type: parallel
        name: pair
        branches:
          - name: bar1
            start: {{at: [0, -40 mm, 0]}}
            chain:
{BAR}\
            end: {{at: [0, -40 mm, 0]}}
          - name: bar2
            start: {{at: [0, 40 mm, 0]}}
            chain:
{BAR}\
            end: {{at: [0, 40 mm, 0]}}
"""
PARALLELOGRAM = f"""{HEAD}\
      - type: parallelogram
        name: pair
        across: [0, 80 mm, 0]
        chain:
{BAR}"""
REPEATED = f"""{HEAD}\
      - type: parallel
        name: pair
        branches:
          repeat: {{count: 2, variable: i, name: bar}}
          let: {{y: (2*i - 3)*40 mm}}
          start: {{at: [0, y, 0]}}
          chain:
{BAR}\
          end: {{at: [0, y, 0]}}
"""


def read(text: str) -> rs.Robot:
    return model_from_document(parse_document(text, file="robot.yaml"))


@pytest.mark.parametrize("text", [PARALLELOGRAM, REPEATED])
def test_ways_to_write_a_parallelogram(text):
    robot, expected = read(text), read(PARALLEL)
    (block,), (wanted,) = (r.legs[0].chain.elements for r in (robot, expected))
    assert isinstance(block, ParallelBlock)
    assert isinstance(wanted, ParallelBlock)
    assert [b.name for b in block.branches] == [b.name for b in wanted.branches]
    for pose in ([0.0], [0.11]):
        first, second = rs.stiffness(robot, pose), rs.stiffness(expected, pose)
        assert distance(first.K, second.K) < 1e-13
        assert int(first.rank) == 5


def wrong(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    with pytest.raises(FileError) as caught:
        read(text)
    return str(caught.value).removeprefix("robot.yaml:")


BLOCK = "legs[0].chain[0]"


def test_a_single_branch():
    text = PARALLEL[: PARALLEL.index("          - name: bar2")]
    assert wrong(text) == (
        f"13:11: {BLOCK}.branches: branches of block 'pair': got ['bar1'], expected at least two; "
        "write at least two branches"
    )


def test_two_branches_of_one_name():
    assert wrong(PARALLEL, ("name: bar2", "name: bar1")) == (
        f"20:19: {BLOCK}.branches[1].name: name of a branch: got 'bar1', expected each name once"
    )


@pytest.mark.parametrize(
    ("text", "old", "new", "place"),
    [
        (PARALLELOGRAM, "across", "acros", "acros"),
        (PARALLEL, "start", "strat", "branches[0].strat"),
        (PARALLEL, "branches", "branchs", "branchs"),
    ],
)
def test_misspelt_keys(text, old, new, place):
    message = wrong(text, (old, new))
    assert f"{BLOCK}.{place}: unknown key" in message
    assert message.endswith(f"did you mean {old}?")


def test_bars_in_one_place():
    assert wrong(PARALLELOGRAM, ("80 mm", "0 mm")) == (
        f"12:17: {BLOCK}.across: across of 'pair': got [0.0, 0.0, 0.0], expected a vector from the "
        "first bar to the second; two bars in one place are one bar of twice the stiffness"
    )


def test_a_branch_that_does_not_close_is_named():
    message = wrong(PARALLEL, ("end: {at: [0, 40 mm, 0]}", "end: {at: [0, 40 mm, 60 mm]}"))
    assert "a gap of 0.06 m and 0 deg at the end of branch 'pair/bar2'" in message
    assert "branches that end where the first one does" in message


def test_names_inside_a_branch():
    text = PARALLEL.replace("type: revolute, axis", "type: revolute, name: near pin, axis", 1)
    assert "branches[0].chain[2].name: name of an element: got 'near pin'" in wrong(text)


def test_blocks_nested_without_end():
    element = "{type: spring, stiffness: [1e6 N/m, 1e6 N/m, 1e6 N/m, 1, 1, 1]}"
    for _ in range(12):
        element = f"{{type: parallelogram, across: [0, 1 mm, 0], chain: [{element}]}}"
    message = wrong(f"{HEAD}      - {element}\n")
    assert "elements inside a parallel block: got 1024, expected at most 1000" in message


# --- snapshots ---

PIN = {"type": "passive", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1]}


def beam(y: float) -> dict:
    element = {"type": "beam", "start": [0, y, 0], "end": [0.3, y, 0], "y_axis": [0, 1, 0]}
    return element | {"E": 2.1e11, "G": 8e10, "A": 8e-4, "Iy": 3e-8, "Iz": 1e-7, "J": 7e-8}


def branch(name: str, y: float) -> dict:
    pins = [PIN | {"point": [x, y, 0]} for x in (0, 0.3)]
    return {"name": name, "end": [0.3, y, 0], "chain": [pins[0], beam(y), pins[1]]}


def file_with(*branches: dict, **changes) -> dict:
    block = {"type": "parallel", "name": "pair", "branches": list(branches)}
    leg = {"name": "leg", "end": [0.3, 0, 0], "chain": [block]}
    return {"name": "pair", "reference_point": [0.3, 0, 0], "legs": [leg]} | changes


def snapshot(data: dict) -> Snapshot:
    return snapshot_from_document(parse_document(json.dumps(data), file="pair.json"))


PAIR = file_with(branch("low", -0.04), branch("high", 0.04))


def test_a_block_of_a_snapshot():
    Draft202012Validator(snapshot_schema()).validate(PAIR)
    given = snapshot(PAIR)
    (block,) = given.legs[0].elements
    assert isinstance(block, PlacedBlock)
    assert [b.name for b in block.branches] == ["pair/low", "pair/high"]
    names = [e.name for e in block.branches[1].elements]
    assert names == ["pair/high/passive1", "pair/high/beam1", "pair/high/passive2"]
    result = rs.stiffness(given)
    assert int(result.rank) == 5
    EA_by_L = 2.1e11 * 8e-4 / 0.3
    assert result.K[0, 0] == pytest.approx(2 * EA_by_L)
    assert result.K[5, 5] == pytest.approx(2 * EA_by_L * 0.04**2)


@pytest.mark.parametrize("name", ["orthoglide", "delta"])
def test_written_and_read_again(name):
    posture = rs.find_posture(rs.load(name))
    data = snapshot_to_data(posture.snapshot.one(0))
    Draft202012Validator(snapshot_schema()).validate(json.loads(json.dumps(data)))
    again = snapshot(data)
    first, second = rs.stiffness(posture.snapshot.one(0)), rs.stiffness(again)
    assert distance(second.K, first.K) < 1e-12
    kept = {part.name for leg in again.legs for part in leg.parts}
    assert kept == {part.name for leg in posture.snapshot.legs for part in leg.parts}


def test_nested_blocks_and_rigid_branches_are_written_too():
    inner = {"type": "parallel", "branches": [branch("a", 0.03), branch("b", 0.05)]}
    rod = {"name": "rod", "end": [0.3, 0, 0], "chain": []}
    outer = {"name": "outer", "end": [0.3, 0.04, 0], "chain": [inner, PIN | {"kind": "P"}]}
    data = file_with(outer, rod)
    data["legs"][0]["chain"].append(beam(0.0))
    given = snapshot(data)
    again = snapshot(snapshot_to_data(given))
    assert distance(rs.stiffness(again).K, rs.stiffness(given).K) < 1e-12
    names = [part.name for part in given.legs[0].parts]
    assert names[0] == "pair/outer/parallel1/a/passive1"


WRONG = {
    "one branch": (
        file_with(branch("low", 0)),
        "legs[0].chain[0].branches: wrong length: got 1 value, expected at least 2 values",
    ),
    "names": (
        file_with(branch("low", 0), branch("low", 0.1)),
        "legs[0].chain[0].branches[1].name: name of the branch: got 'low', expected a name that no "
        "other has",
    ),
    "direction deep inside": (
        file_with(branch("low", 0), branch("high", 0.1) | {"chain": [PIN | {"axis": [0, 0, 0]}]}),
        "legs[0].chain[0].branches[1].chain[0].axis: axis: got [0, 0, 0], expected a direction; a "
        "zero vector points nowhere",
    ),
    "misspelt": (
        file_with(branch("low", 0), branch("high", 0.1) | {"ending": 3}),
        "legs[0].chain[0].branches[1].ending: unknown key: expected one of name, end, chain, "
        "couplings, masses, note",
    ),
    "out of the plane": (
        file_with(
            branch("low", 0), branch("high", 0.1) | {"chain": [PIN | {"axis": [1, 0, 0]}]},
            planar=True,
        ),
        "legs[0].chain[0].branches[1].chain[0].axis: axis of a joint of a planar robot: got "
        "[1, 0, 0], expected an axis along z of the world; planar robots move in the x-y plane; "
        "leave planar: out for any other",
    ),
    "no compliance": (
        file_with(*(branch(n, 0) | {"chain": [PIN]} for n in "ab")),
        "legs[0].chain: leg leg without compliance: expected at least one beam, spring or spring6; "
        "a leg of rigid parts and passive joints alone has no stiffness matrix",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_a_snapshot_may_not_say(case):
    data, message = WRONG[case]
    with pytest.raises(FileError) as caught:
        snapshot(data)
    assert str(caught.value).partition(": ")[2] == message


def test_a_planar_snapshot_with_a_block():
    result = rs.stiffness(snapshot(PAIR | {"planar": True}))
    assert result.K.shape == (3, 3)
    plane = np.ix_([0, 1, 5], [0, 1, 5])
    assert distance(result.K, rs.stiffness(snapshot(PAIR)).K[plane]) < 1e-12
