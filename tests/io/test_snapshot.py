"""Snapshot files: reading, writing, the published schema and the documented example."""

from __future__ import annotations

import json
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from scipy.spatial.transform import Rotation

import robostiff as rs
import robostiff.io.snapshot
from robostiff.analysis import stiffness
from robostiff.elasticity import beam_compliance, elasticity_from_stiffness
from robostiff.elastostatics import chain_stiffness
from robostiff.errors import FileError, InputError, PlausibilityWarning
from robostiff.io.document import parse_document
from robostiff.io.snapshot import (
    is_snapshot,
    read_snapshot,
    snapshot_from_document,
    snapshot_schema,
    snapshot_to_data,
)
from robostiff.kinematics import find_posture
from robostiff.model import PlacedFreedom, PlacedLeg, PlacedSpring, beam_axes
from robostiff.robots import load
from robostiff.spatial import Space

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


def test_spring_element():
    (leg,) = read(robot(SPRING)).legs
    joint = leg.elements[0]
    assert isinstance(joint, PlacedFreedom)
    assert (joint.pitch, joint.role) == (None, rs.Actuated(stiffness=2e6))
    np.testing.assert_allclose(joint.axis, [0.6, 0, 0.8])


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


def test_spring6_element_of_stiffness_and_of_compliance():
    K = np.diag([1e5, 2e5, 4e5, 200, 100, 50])
    by_K, by_C = (
        read(robot(RUBBER | {key: matrix.tolist()})).legs[0].elements[0]
        for key, matrix in (("K", K), ("compliance", np.linalg.inv(K)))
    )
    assert isinstance(by_K, PlacedSpring)
    assert isinstance(by_C, PlacedSpring)
    assert by_K.rotation.tolist() == RUBBER["rotation"]
    np.testing.assert_allclose(by_K.elasticity.compliance, np.linalg.inv(K), rtol=1e-14)
    np.testing.assert_allclose(by_C.elasticity.compliance, np.linalg.inv(K), rtol=1e-14)


def test_the_rest_of_the_file():
    data = robot(SPRING, planar=False, description="one spring", units="mm?", notes=[1, {"a": 2}])
    snapshot = read(data | {"$schema": "snapshot.schema.json", "oracle": None, "note": 3})
    assert (snapshot.name, snapshot.description) == ("arm", "one spring")
    assert snapshot.space is Space.SPATIAL
    assert snapshot.reference_point.tolist() == [0.5, 0.1, 0]
    assert snapshot.legs[0].name == "leg"
    assert snapshot.legs[0].end.tolist() == [0.5, 0, 0]


def test_default_names_avoid_given_ones():
    named = PASSIVE | {"name": "passive1"}
    chain = [PASSIVE, beam(), named, PASSIVE, SPRING, beam(name="boom"), beam()]
    names = [element.name for element in read(robot(*chain)).legs[0].elements]
    assert names == ["passive2", "beam1", "passive1", "passive3", "spring1", "boom", "beam2"]


def test_null_is_the_same_as_leaving_out():
    element = RUBBER | {"K": np.eye(6).tolist(), "compliance": None, "name": None}
    assert read(robot(element)).legs[0].elements[0].name == "spring61"


def test_directions_of_any_size():
    for size in (1e-200, 1e200):
        (leg,) = read(robot(SPRING | {"axis": [3 * size, 0, 4 * size]})).legs
        joint = leg.elements[0]
        assert isinstance(joint, PlacedFreedom)
        np.testing.assert_allclose(joint.axis, [0.6, 0, 0.8])


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


# Planar


# Writing


def same_stiffness(first: rs.Snapshot, second: rs.Snapshot) -> None:
    one, two = stiffness(first), stiffness(second)
    assert one.status == two.status
    assert one.rank == two.rank
    size = np.sqrt(np.maximum(np.diagonal(one.K), np.diagonal(one.K).max() * 1e-9))
    assert np.abs((one.K - two.K) / np.outer(size, size)).max() < 1e-12


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_cases_survive_a_round_trip(path):
    snapshot = read_snapshot(path)
    data = snapshot_to_data(snapshot)
    Draft202012Validator(snapshot_schema()).validate(data)
    again = read(data)
    assert snapshot_to_data(again).keys() == data.keys()
    for leg, leg_again in zip(snapshot.legs, again.legs, strict=True):
        names = [element.name for element in leg.elements]
        assert [element.name for element in leg_again.elements] == names
    same_stiffness(snapshot, again)


numbers = st.floats(-2, 2, allow_subnormal=False).map(lambda x: round(x, 6))
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
rotations = directions.map(lambda v: Rotation.from_rotvec(2 * v).as_matrix())
roles = st.sampled_from(
    [rs.Passive(), rs.Actuated(3e5), rs.Locked(2e4), rs.Actuated(None), rs.Locked(None)]
)
pitches = st.sampled_from([0.0, None, 0.005, -0.8])
freedoms = st.builds(PlacedFreedom, directions, vectors, pitches, st.sampled_from("abc"), roles)


@st.composite
def springs(draw) -> PlacedSpring:
    root = np.array(draw(st.lists(vectors, min_size=12, max_size=12))).reshape(6, 6)
    rank = draw(st.integers(1, 6))
    units = np.repeat([1e-4, 1e-2], 3)
    values = np.array([*[1.0] * rank, *[0.0] * (6 - rank)]) * np.linspace(1, 2, 6)
    modes = np.linalg.qr(root + 3 * np.eye(6))[0]
    C = (modes * values) @ modes.T * np.outer(units, units)
    kind = draw(st.sampled_from(["compliance", "stiffness", "beam"]))
    if kind == "compliance":
        elasticity = rs.Elasticity((C + C.T) / 2)
    elif kind == "stiffness":
        K = C / np.outer(units, units) ** 2
        elasticity = elasticity_from_stiffness((K + K.T) / 2)
    else:
        section = rs.CrossSection(8e-4, 3e-8, 1e-7, 7e-8)
        elasticity = rs.Elasticity(beam_compliance(0.7, rs.Material("steel", 2e11, 8e10), section))
    return PlacedSpring(draw(st.sampled_from("abc")), draw(vectors), draw(rotations), elasticity)


SOFT = PlacedSpring("soft", np.ones(3), np.eye(3), rs.Elasticity(np.diag([1e-7] * 3 + [1e-4] * 3)))


@given(st.lists(st.one_of(freedoms, springs()), max_size=6), vectors, vectors)
def test_any_snapshot_survives_a_round_trip(elements, end, reference_point):
    leg = PlacedLeg("leg", (SOFT, *elements), end)
    snapshot = rs.Snapshot("robot", (leg, replace(leg, name="leg")), reference_point)
    data = snapshot_to_data(snapshot)
    Draft202012Validator(snapshot_schema()).validate(data)
    again = read(json.loads(json.dumps(data)))
    assert [leg.name for leg in again.legs] == ["leg", "leg (2)"]
    assert again.reference_point.tolist() == snapshot.reference_point.tolist()
    kept = [e for e in leg.own_parts if isinstance(e, PlacedSpring) or not is_rigid(e)]
    for leg_again in again.legs:
        assert leg_again.end.tolist() == leg.end.tolist()
        assert len({element.name for element in leg_again.elements}) == len(kept)
        for element, element_again in zip(kept, leg_again.own_parts, strict=True):
            same_element(element, element_again)


def is_rigid(joint: PlacedFreedom) -> bool:
    return not joint.is_passive and joint.stiffness is None


def same_element(
    one: PlacedFreedom | PlacedSpring, two: PlacedFreedom | PlacedSpring, tolerance: float = 1e-12
) -> None:
    np.testing.assert_array_equal(one.point, two.point)
    if isinstance(one, PlacedFreedom):
        assert isinstance(two, PlacedFreedom)
        np.testing.assert_allclose(one.axis, two.axis, atol=1e-15)
        assert (one.is_passive, one.stiffness) == (two.is_passive, two.stiffness)
        assert (one.pitch is None) == (two.pitch is None)
        assert one.pitch is None or one.pitch == pytest.approx(two.pitch, rel=1e-15)
        return
    assert isinstance(two, PlacedSpring)
    np.testing.assert_allclose(one.rotation, two.rotation, atol=1e-14)
    K_one, K_two = (stiffness_of(part.elasticity) for part in (one, two))
    C_one, C_two = one.elasticity.compliance, two.elasticity.compliance
    if K_one is None or K_two is None:
        assert not one.elasticity.freedoms.size
        np.testing.assert_array_equal(C_one, C_two)
    elif one.elasticity.freedoms.size:
        assert one.elasticity.freedoms.shape == two.elasticity.freedoms.shape
        diagonal = np.diagonal(K_one).reshape(2, 3).max(axis=1)
        size = np.sqrt(np.maximum(diagonal, 1e-12)).repeat(3)
        assert np.all(np.abs(K_one - K_two) <= tolerance * np.outer(size, size))
    else:
        size = np.sqrt(np.diagonal(C_one))
        assert np.all(np.abs(C_one - C_two) <= tolerance * np.outer(size, size))


def stiffness_of(elasticity: rs.Elasticity) -> np.ndarray | None:
    result = chain_stiffness(elasticity.compliance, elasticity.freedoms)
    return result.K if result.status.has_stiffness else None


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


def test_several_poses_are_refused():
    snapshot = read(robot(beam()))
    several = replace(snapshot, reference_point=np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"shape of the batch of poses: got \(2,\), expected one"):
        snapshot_to_data(several)


def test_a_beam_is_written_by_its_stiffness_and_a_rigid_direction_by_its_compliance():
    (element,) = snapshot_to_data(read(robot(beam())))["legs"][0]["chain"]
    assert (element["type"], "K" in element, "compliance" in element) == ("spring6", True, False)
    rigid = RUBBER | {"compliance": np.diag([1e-6, 0, 0, 0, 1e-3, 0]).tolist()}
    (element,) = snapshot_to_data(read(robot(rigid)))["legs"][0]["chain"]
    assert element["compliance"] == rigid["compliance"]


def test_a_leg_without_compliance_is_not_written():
    rigid = PlacedFreedom(np.eye(3)[0], np.zeros(3), 0.0, "drive", rs.Actuated())
    snapshot = rs.Snapshot("arm", (PlacedLeg("leg", (rigid,), np.zeros(3)),), np.zeros(3))
    with pytest.raises(InputError, match="leg leg without compliance"):
        snapshot_to_data(snapshot)


def test_a_spring_both_free_and_rigid_is_not_written():
    elasticity = rs.Elasticity(np.diag([1e-6, 1e-6, 1e-6, 0, 0, 0]), np.eye(6)[:, 5:])
    odd = PlacedSpring("odd", np.zeros(3), np.eye(3), elasticity)
    snapshot = rs.Snapshot("arm", (PlacedLeg("leg", (odd,), np.zeros(3)),), np.zeros(3))
    with pytest.raises(InputError, match="spring odd with directions both free and rigid"):
        snapshot_to_data(snapshot)


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
    robot = load("gough-stewart-a")
    snapshot = find_posture(robot, [0.1, 0.2, 1.9, 0.2, -0.1, 0.3]).snapshot.one(0)
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
