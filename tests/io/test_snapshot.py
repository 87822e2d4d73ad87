"""Snapshot files: read, written, documented, and refused."""

from __future__ import annotations

import json
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
import robostiff.io.snapshot
from robostiff.analysis import stiffness
from robostiff.elasticity import beam_compliance
from robostiff.errors import FileError, InputError, PlausibilityWarning
from robostiff.io.document import parse_document
from robostiff.io.snapshot import (
    is_snapshot,
    read_snapshot,
    snapshot_from_document,
    snapshot_schema,
    snapshot_to_data,
)
from robostiff.model import PlacedElement, PlacedFreedom, PlacedLeg, PlacedSpring, beam_axes
from robostiff.spatial import Space
from tests.campaign import placed
from tests.files import text_of

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "wall-crane.json"
CASES = sorted((ROOT / "tests" / "cases" / "data").glob("*.json"))


def read(data: dict) -> rs.Snapshot:
    return snapshot_from_document(parse_document(json.dumps(data), file="robot.json"))


def beam(**changes) -> dict:
    element = {"type": "beam", "start": [0, 0, 0], "end": [0.5, 0, 0], "y_axis": [0.3, 2, 0]}
    element |= {"E": 2.1e11, "G": 8e10, "A": 8e-4, "Iy": 3e-8, "Iz": 1e-7, "J": 7e-8}
    return element | changes


def robot(*elements: dict, **changes) -> dict:
    leg = {"name": "leg", "end": [0.5, 0, 0], "chain": list(elements)}
    return {"name": "arm", "reference_point": [0.5, 0.1, 0], "legs": [leg]} | changes


PASSIVE = {"type": "passive", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, -2]}
SPRING = {"type": "spring", "kind": "P", "point": [0, 0, 0], "axis": [3, 0, 4], "k": 2e6}
RUBBER = {"type": "spring6", "point": [1, 0, 0], "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}


# What each element becomes


@pytest.mark.parametrize("factors", [{}, {"shear_factor_y": 0.8, "shear_factor_z": 0.9}])
def test_beam_element(factors):
    (leg,) = read(robot(beam(end=[0, 0.3, 0.4], y_axis=[1, 1, 1], **factors))).legs
    part = leg.elements[0]
    assert isinstance(part, PlacedSpring)
    assert part.point.tolist() == [0, 0.3, 0.4]
    axes = beam_axes(np.array([0, 0.3, 0.4]), np.array([1.0, 1, 1]))
    np.testing.assert_allclose(part.rotation, axes, atol=1e-15)
    section = rs.CrossSection(8e-4, 3e-8, 1e-7, 7e-8, *factors.values())
    theory = (rs.Timoshenko(),) if factors else ()
    C = beam_compliance(0.5, rs.Material("steel", 2.1e11, 8e10), section, *theory)
    np.testing.assert_allclose(part.elasticity.compliance, C, rtol=1e-14)


def test_the_rest_of_the_file():
    data = robot(SPRING, planar=False, description="one spring", units="mm?", notes=[1, {"a": 2}])
    snapshot = read(data | {"$schema": "snapshot.schema.json", "oracle": None, "note": 3})
    assert (snapshot.name, snapshot.description) == ("arm", "one spring")
    assert snapshot.space is Space.SPATIAL
    assert snapshot.reference_point.tolist() == [0.5, 0.1, 0]
    assert snapshot.legs[0].name == "leg"
    assert snapshot.legs[0].end.tolist() == [0.5, 0, 0]


# What is a snapshot


@pytest.mark.parametrize(
    ("data", "answer"),
    [
        (robot(SPRING), True),
        ({"reference_point": [0, 0, 0]}, True),
        ({"graph": {}}, True),
        ({"legs": [{"chain": [], "end": [0, 0, 0]}]}, True),
        ({"robostiff": 1, "reference_point": [0, 0, 0]}, False),
        ({"legs": [{"chain": []}]}, False),
        ({"legs": "six"}, False),
        ({}, False),
        ([robot(SPRING)], False),
        ("text", False),
        (None, False),
    ],
)
def test_is_snapshot(data, answer):
    assert is_snapshot(parse_document(json.dumps(data), file="x.json")) is answer


# Writing


def same_stiffness(first: rs.Snapshot, second: rs.Snapshot) -> None:
    one, two = stiffness(first), stiffness(second)
    assert one.status == two.status
    assert one.rank == two.rank
    own, other = (own.K if one.answered else own.details().matrix for own in (one, two))
    size = np.sqrt(np.maximum(np.diagonal(own), np.diagonal(own).max() * 1e-9))
    assert np.abs((own - other) / np.outer(size, size)).max() < 1e-12


@pytest.mark.filterwarnings("ignore::robostiff.PlausibilityWarning")
@pytest.mark.parametrize(
    "made",
    [*CASES, *(kind for kind in placed.KINDS if kind != "platform")],
    ids=lambda made: getattr(made, "stem", made),
)
def test_what_is_written_is_read_as_the_same_robot(made):
    """Cases, and random robots; their springs alone are written by other words."""
    random = isinstance(made, str)
    seeds = range(3 if random else 1)
    said: list[str] = []
    for seed in seeds:
        given = placed.KINDS[made](np.random.default_rng(seed)) if random else read_snapshot(made)
        try:
            data = json.loads(json.dumps(snapshot_to_data(given)))
        except InputError as error:
            said.append(str(error))
            continue
        Draft202012Validator(snapshot_schema()).validate(data)
        again = read(data)
        assert snapshot_to_data(again).keys() == data.keys()
        np.testing.assert_array_equal(again.reference_point, given.reference_point)
        assert len({leg.name for leg in again.legs}) == len(given.legs)
        for leg, other in zip(given.legs, again.legs, strict=True):
            np.testing.assert_array_equal(other.end, leg.end)
            kept = [own for own in leg.parts if not is_rigid(own)]
            for one, two in zip(kept, other.parts, strict=True):
                np.testing.assert_array_equal(two.point, one.point)
                if isinstance(one, PlacedFreedom):
                    assert isinstance(two, PlacedFreedom)
                    np.testing.assert_allclose(two.axis, one.axis, atol=1e-15)
                    assert (one.is_passive, one.stiffness) == (two.is_passive, two.stiffness)
                    assert (one.pitch is None) == (two.pitch is None)
                    assert (one.pitch or 0) == pytest.approx(two.pitch or 0, rel=1e-15)
                else:
                    assert isinstance(two, PlacedSpring)
                    same_spring(one, two)
        if made != "mixed":  # whose digits are judged in tests/campaign/ways.py
            same_stiffness(given, again)
    assert all("without compliance" in own or "free and rigid" in own for own in said)
    assert 2 * len(said) <= len(seeds)


def same_spring(one: PlacedSpring, two: PlacedSpring) -> None:
    """In each of its directions, of which those that are free may be other words of one space."""
    np.testing.assert_allclose(two.rotation, one.rotation, atol=1e-14)
    assert one.elasticity.freedoms.shape == two.elasticity.freedoms.shape
    if not one.elasticity.freedoms.size:
        C, other = one.elasticity.compliance, two.elasticity.compliance
        size = np.sqrt(np.diagonal(C))
        assert np.all(np.abs(C - other) <= 1e-12 * np.outer(size, size))


def is_rigid(own: PlacedElement) -> bool:
    return isinstance(own, PlacedFreedom) and not own.is_passive and own.stiffness is None


def test_names_that_are_twice_are_numbered():
    leg = read(robot(beam(), PASSIVE)).legs[0]
    twice = replace(leg, elements=(*leg.elements, *leg.elements))
    data = snapshot_to_data(rs.Snapshot("robot", (twice, twice), np.zeros(3)))
    assert [own["name"] for own in data["legs"]] == ["leg", "leg (2)"]
    names = [own["name"] for own in data["legs"][0]["chain"]]
    assert len(set(names)) == 4


def test_one_pose_of_a_batch_is_written():
    single = read(robot(PASSIVE, beam()))
    joint, part = single.legs[0].elements
    assert isinstance(joint, PlacedFreedom)
    assert isinstance(part, PlacedSpring)
    elasticity = rs.Elasticity(part.elasticity.compliance[None])
    elements = (
        replace(joint, point=joint.point[None], axis=joint.axis[None]),
        replace(part, rotation=part.rotation[None], elasticity=elasticity),
    )
    leg = PlacedLeg("leg", elements, single.legs[0].end)
    batch = rs.Snapshot("arm", (leg,), single.reference_point[None])
    assert snapshot_to_data(batch) == snapshot_to_data(single)


def test_a_beam_is_written_by_its_stiffness_and_a_rigid_direction_by_its_compliance():
    (element,) = snapshot_to_data(read(robot(beam())))["legs"][0]["chain"]
    assert (element["type"], "K" in element, "compliance" in element) == ("spring6", True, False)
    rigid = RUBBER | {"compliance": np.diag([1e-6, 0, 0, 0, 1e-3, 0]).tolist()}
    (element,) = snapshot_to_data(read(robot(rigid)))["legs"][0]["chain"]
    assert element["compliance"] == rigid["compliance"]


# Schema and documentation


def test_the_published_schema_is_the_one_of_the_models():
    published = Path(robostiff.io.snapshot.__file__).parent / "snapshot.schema.json"
    assert json.loads(published.read_text()) == snapshot_schema(), (
        "regenerate it: robostiff schema snapshot > src/robostiff/io/snapshot/snapshot.schema.json"
    )


@pytest.mark.parametrize(
    "data",
    [
        robot(SPRING, legz=[]),
        robot(SPRING | {"k": 0}),
        robot(SPRING | {"axis": [1, 2]}),
        robot(RUBBER),
        robot(RUBBER | {"K": np.eye(6).tolist(), "compliance": np.eye(6).tolist()}),
        robot(RUBBER | {"K": np.eye(5).tolist()}),
        robot(),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(data):
    assert not Draft202012Validator(snapshot_schema()).is_valid(data)
    with pytest.raises(FileError):
        read(data)


def test_the_documented_example_is_the_shipped_one_and_computes():
    text = (ROOT / "docs" / "snapshot.md").read_text()
    block, element = re.findall(r"```json\n(.*?)```", text, re.DOTALL)
    assert len(read(robot(json.loads(element), beam())).legs[0].blocks) == 1
    assert block == EXAMPLE.read_text()
    data = json.loads(block)
    Draft202012Validator(snapshot_schema()).validate(data)
    result = stiffness(read(data))
    assert result.rank == 6
    assert result.compliance is not None
    sine, tangent = 3 / 5, 3 / 4
    expected = 1 / (2e7 * sine**2) + 1.2 / (210e9 * 1.2e-3) / tangent**2
    assert result.compliance[2, 2] == pytest.approx(expected, rel=1e-12)
    assert f"{expected:.4e}" in text
    assert f"{expected * 1e6:.3f} mm" in text


def test_the_documented_messages_are_the_real_ones():
    text = (ROOT / "docs" / "snapshot.md").read_text()
    (block,) = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    example = EXAMPLE.read_text()
    wrong = (example.replace('"axis"', '"axes"', 1), example.replace("1.2e-3", "-1.2e-3", 1))
    messages = []
    for content in wrong:
        with pytest.raises(FileError) as caught:
            snapshot_from_document(parse_document(content, file="crane.json"))
        messages.append(str(caught.value))
    assert block.splitlines() == messages


def test_every_key_is_documented():
    text = (ROOT / "docs" / "snapshot.md").read_text()
    schema = snapshot_schema()
    models = [schema, *schema["$defs"].values()]
    keys = {key for model in models for key in model["properties"]}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


def test_rounded_coordinates_leave_a_rank_in_doubt():
    """Case A has three free rotations; at a turned pose one is left. Rounding leaves none."""
    robot = rs.load("gough-stewart-a")
    snapshot = rs.find_posture(robot, [0.1, 0.2, 1.9, 0.2, -0.1, 0.3]).snapshot.one(0)
    exact = snapshot_to_data(snapshot)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert stiffness(read(exact)).rank == 5
    rounded = json.loads(json.dumps(exact), parse_float=lambda text: round(float(text), 4))
    with pytest.warns(PlausibilityWarning, match="rank 6 is decided by .* in the platform"):
        assert stiffness(read(rounded)).rank == 6


def test_rounded_coordinates_leave_a_redundant_joint_in_doubt():
    """Two hinges of one axis, of which one is lost; apart by rounding they are two freedoms."""
    hinge = {"type": "passive", "kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1]}
    other = hinge | {"point": [0, 0, 0.1], "axis": [1e-4, 0, 1]}
    data = {"name": "arm", "reference_point": [0.5, 0, 0]}
    leg = {"name": "arm", "end": [0.5, 0, 0]}
    with pytest.warns(PlausibilityWarning, match="rank 4 is decided by .* in leg 'arm'"):
        assert stiffness(read(data | {"legs": [leg | {"chain": [hinge, other, beam()]}]})).rank == 4


# One element a line, so that lines can be counted.
TEXT = text_of("arm-snapshot.json")


PLANAR = """{"name": "arm", "planar": true, "reference_point": [0, 0, 0],
"legs": [{"name": "leg", "end": [0, 0, 0], "chain": [
{"type": "spring", "kind": "R", "point": [0, 0, 9], "axis": [0, 0, 1], "k": 9},
"""
