"""The graph form of snapshot files: what it says, and what it may not say."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
from robostiff import find_posture, load, stiffness
from robostiff.errors import FileError, InputError, NoAnswerError
from robostiff.io.document import parse_document
from robostiff.io.snapshot import (
    is_graph,
    is_snapshot,
    network_from_document,
    network_schema,
    network_to_data,
    snapshot_to_data,
)
from robostiff.model import Robot
from robostiff.network import Network, compliance_between, network_of_snapshot
from tests.network.frames import GRAPH_NAMES, GRAPHS, graph

# One element a line, so that lines can be counted.
TEXT = """{
 "name": "table", "reference_point": [0, 0, 1],
 "graph": {
  "nodes": {"floor": [0, 0, 0], "foot": [0, 0, 0.1], "top": [0, 0, 1]},
  "fixed": ["floor"],
  "platform": "top",
  "joints": [
   {"a": "floor", "b": "foot",
    "dofs": [{"kind": "R", "point": [0, 0, 0], "axis": [0, 0, 1], "k": null}]}
  ],
  "beams": [
   {"a": "foot", "b": "top", "start": [0, 0, 0.1], "end": [0, 0, 1], "y_axis": [0, 1, 0],
    "E": 2.1e11, "G": 8e10, "A": 8e-4, "Iy": 3e-8, "Iz": 1e-7, "J": 7e-8}
  ],
  "springs": [
   {"name": "pad", "a": "floor", "b": "top", "point": [0, 0, 1],
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "K": [[1e6, 0, 0, 0, 0, 0], [0, 1e6, 0, 0, 0, 0], [0, 0, 1e6, 0, 0, 0],
     [0, 0, 0, 1e3, 0, 0], [0, 0, 0, 0, 1e3, 0], [0, 0, 0, 0, 0, 0]]}
  ]
 }
}
"""

WRONG = {
    "unknown node of a beam": (
        '"b": "top", "start"',
        '"b": "tip", "start"',
        "12:23: graph.beams[0].b: node: got 'tip', expected one of the nodes: floor, foot, top; "
        "did you mean top?",
    ),
    "unknown fixed node": (
        '["floor"]',
        '["flor"]',
        "5:13: graph.fixed[0]: node: got 'flor', expected one of the nodes: floor, foot, top; did "
        "you mean floor?",
    ),
    "fixed platform": (
        '"platform": "top"',
        '"platform": "floor"',
        "6:15: graph.platform: platform: got 'floor', expected a node that is not fixed",
    ),
    "from a node to itself": (
        '"a": "floor", "b": "foot"',
        '"a": "foot", "b": "foot"',
        "8:23: graph.joints[0].b: node b: got 'foot', expected a node other than a",
    ),
    "joint motion without k": (
        ', "k": null',
        "",
        "9:14: graph.joints[0].dofs[0].k: missing key; k is the stiffness, N m/rad for R and H, "
        "N/m for P; null for a passive motion",
    ),
    "negative stiffness": (
        '"k": null',
        '"k": -3',
        "9:72: graph.joints[0].dofs[0].k: wrong value: got -3, expected a positive number",
    ),
    "misspelt key": (
        '"beams"',
        '"baems"',
        "11:3: graph.baems: unknown key: expected one of nodes, fixed, platform, beams, springs, "
        "joints, couplings, masses, note; did you mean beams?",
    ),
    "axis of no length": (
        '"axis": [0, 0, 1]',
        '"axis": [0, 0, 0]',
        "9:56: graph.joints[0].dofs[0].axis: axis: got [0, 0, 0], expected a direction; a zero "
        "vector points nowhere",
    ),
    "beam of no length": (
        '"end": [0, 0, 1]',
        '"end": [0, 0, 0.1]',
        "12:59: graph.beams[0].end: beam of no length: got [0, 0, 0.1], expected a point other "
        "than its start",
    ),
    "nothing fixed": (
        '["floor"]',
        "[]",
        "5:12: graph.fixed: wrong length: got 0 values, expected at least 1 value",
    ),
    "part out of the plane": (
        '"reference_point": [0, 0, 1],',
        '"reference_point": [0, 0, 1], "planar": true,',
        "12:4: graph.beams[0]: part 'beam1' of a planar network: got 'an elasticity that couples "
        "motions in the plane with motions out of it', expected principal axes along and across "
        "the plane; leave out 'planar: true' to compute in space",
    ),
}


def complaint(text: str) -> str:
    with pytest.raises(FileError) as caught:
        network_from_document(parse_document(text, file="table.json"))
    return str(caught.value)


@pytest.mark.parametrize("name", WRONG)
def test_message_and_place(name):
    old, new, message = WRONG[name]
    assert old in TEXT
    assert complaint(TEXT.replace(old, new, 1)) == f"table.json:{message}"


def test_a_network_without_compliance_is_refused():
    data = json.loads(TEXT)
    del data["graph"]["beams"], data["graph"]["springs"]
    assert "network table without compliance" in complaint(json.dumps(data))


def test_two_elements_of_one_name_are_refused():
    data = json.loads(TEXT)
    data["graph"]["springs"] *= 2
    assert "graph.springs[1].name: name of the spring: got 'pad'" in complaint(json.dumps(data))


def test_what_the_file_says():
    network = network_from_document(parse_document(TEXT))
    assert network.free_nodes == ("foot", "top")
    assert [e.name for e in network.elements] == ["beam1", "pad", "joint1"]
    assert network.joints[0].freedoms[0].is_passive
    assert network.springs[0].elasticity.freedoms.shape == (6, 1)
    result = rs.stiffness(network)
    assert [str(motion) for motion in result.free_motions] == [
        "rotation about z through (0, 0, 1) m"
    ]


def test_load_tells_graphs_from_legs():
    robot = rs.load(GRAPHS / f"{GRAPH_NAMES[0]}.json")
    assert isinstance(robot, Network)
    assert isinstance(robot, rs.Network)
    document = parse_document(TEXT)
    assert is_snapshot(document)
    assert is_graph(document)


def test_parameters_of_a_graph_are_refused():
    with pytest.raises(rs.InputError, match="frozen at one pose"):
        rs.load(GRAPHS / f"{GRAPH_NAMES[0]}.json", {"h": 1.0})


@pytest.mark.parametrize("name", GRAPH_NAMES)
def test_the_cases_fit_the_schema(name):
    data = json.loads((GRAPHS / f"{name}.json").read_text())
    Draft202012Validator(network_schema()).validate(data)
    network = load(GRAPHS / f"{name}.json")
    assert isinstance(network, Network)
    assert len(network.beams) == len(data["graph"]["beams"])
    np.testing.assert_array_equal(network.reference_point, data["reference_point"])


def test_the_schema_is_one():
    Draft202012Validator.check_schema(network_schema())


@pytest.mark.parametrize("name", ["hexapod", "3-rpr-beams", "six-joint-arm", "star"])
def test_networks_are_written_and_read_back(name):
    file = Path(__file__).parents[1] / "model" / "star-platform.yaml"
    robot = load(file if name == "star" else name)
    assert isinstance(robot, Robot)
    network = network_of_snapshot(find_posture(robot).snapshot.one(0))
    text = json.dumps(network_to_data(network))
    again = network_from_document(parse_document(text, file="network.json"))
    K = stiffness(network).K
    assert np.allclose(stiffness(again).K, K, rtol=1e-9, atol=1e-9 * np.abs(K).max())
    assert again.space is network.space


def test_beams_and_welds_are_written():
    network, oracle = graph(GRAPH_NAMES[0])
    again = network_from_document(parse_document(json.dumps(network_to_data(network))))
    K = np.array(oracle["K"])
    assert np.allclose(stiffness(again).K, K, rtol=0, atol=1e-9 * np.abs(K).max())
    with pytest.raises(InputError, match="without compliance"):
        network_to_data(replace(network, beams=(), springs=(), joints=()))


def test_a_flexible_platform_is_written_as_a_graph():
    robot = load(Path(__file__).parents[1] / "model" / "star-platform.yaml")
    assert isinstance(robot, Robot)
    with pytest.raises(InputError, match="network_to_data"):
        snapshot_to_data(find_posture(robot).snapshot.one(0))


def geared(sum_: dict[str, float], k: float | None, first: str = "a") -> Network:
    """A slide with a spring, and on another one a body that slides and turns, geared to it."""
    slide = {"kind": "P", "point": [0, 0, 0], "axis": [1, 0, 0]}
    turn = {"kind": "R", "point": [0, 0.3, 0], "axis": [1, 0, 0]}
    data = {
        "name": "gear",
        "reference_point": [0, 0.3, 0],
        "graph": {
            "nodes": {"wall": [0, 0, 0], "rack": [0.2, 0, 0], "table": [0, 0.3, 0]},
            "fixed": ["wall"],
            "platform": "table",
            "joints": [
                {"name": first, "a": "wall", "b": "rack", "dofs": [{**slide, "k": 3e5}]},
                {
                    "name": "b",
                    "a": "wall",
                    "b": "table",
                    "dofs": [{**slide, "point": [0, 0.3, 0], "k": None}, {**turn, "k": None}],
                },
            ],
            "couplings": [{"name": "gear", "sum": sum_, "k": k}],
        },
    }
    Draft202012Validator(network_schema()).validate(data)
    text = json.dumps(data)
    again = json.dumps(network_to_data(network_from_document(parse_document(text))))
    return network_from_document(parse_document(again))


@pytest.mark.parametrize(("motion", "row"), [("b/dof1", 0), ("b/dof2", 3)])
@pytest.mark.parametrize("k", [None, 7e4])
def test_a_gear_between_joints_of_different_legs(motion: str, row: int, k: float | None):
    """q_b = r q_a: the spring of one is felt at the other, C = r^2 / k_a + 1 / k."""
    r = -1.6
    network = geared({motion: 1.0, "a": -r}, k)
    table, unit = [("table", network.reference_point)], np.eye(6)
    C = compliance_between(network, table, loads=unit[:, [row]])
    assert np.isclose(C[0, 0], r**2 / 3e5 + (0.0 if k is None else 1 / k), rtol=1e-10)
    with pytest.raises(NoAnswerError):  # the other motion of the joint is free
        compliance_between(network, table, loads=unit[:, [3 - row]])


def test_gears_of_graphs_have_errors_with_a_place():
    with pytest.raises(FileError, match=r"couplings\[0\]\.sum\.b: motion of a joint.*b/dof1"):
        geared({"b": 1.0, "a": 1.0}, None)
    with pytest.raises(FileError, match="a number other than zero"):
        geared({"b/dof1": 0.0, "a": 1.0}, None)
    with pytest.raises(FileError, match="got 'b/dof1', expected a name of one motion"):
        geared({"b/dof1": 1.0, "b/dof2": 1.0}, None, first="b/dof1")
