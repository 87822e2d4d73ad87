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
from tests.files import text_of

PARALLEL = text_of("pair-of-bars.yaml")
PARALLELOGRAM = text_of("parallelogram.yaml")
REPEATED = text_of("repeated-bars.yaml")
HEAD = PARALLELOGRAM.partition("      - type")[0]


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


def test_blocks_nested_without_end():
    element = "{type: spring, stiffness: [1e6 N/m, 1e6 N/m, 1e6 N/m, 1, 1, 1]}"
    for _ in range(12):
        element = f"{{type: parallelogram, across: [0, 1 mm, 0], chain: [{element}]}}"
    message = "elements inside a parallel block: got 1024, expected at most 1000"
    with pytest.raises(FileError, match=message):
        read(f"{HEAD}      - {element}\n")


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


def test_a_planar_snapshot_with_a_block():
    result = rs.stiffness(snapshot(PAIR | {"planar": True}))
    assert result.K.shape == (3, 3)
    plane = np.ix_([0, 1, 5], [0, 1, 5])
    assert distance(result.K, rs.stiffness(snapshot(PAIR)).K[plane]) < 1e-12
