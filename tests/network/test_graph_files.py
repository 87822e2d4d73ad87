"""The graph form of snapshot files: what it says, and what it may not say."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.snapshot import (
    is_graph,
    is_snapshot,
    network_from_document,
    network_schema,
    network_to_data,
)
from robostiff.network import Network, compliance_between, network_of_snapshot
from tests.files import text_of
from tests.network.frames import GRAPH_NAMES, GRAPHS, graph

# One element a line, so that lines can be counted.
TEXT = text_of("table-of-bodies.json")


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
    assert isinstance(robot, rs.Network)
    document = parse_document(TEXT)
    assert is_snapshot(document)
    assert is_graph(document)


@pytest.mark.parametrize("name", GRAPH_NAMES)
def test_the_cases_fit_the_schema(name):
    data = json.loads((GRAPHS / f"{name}.json").read_text())
    Draft202012Validator(network_schema()).validate(data)
    network = rs.load(GRAPHS / f"{name}.json")
    assert len(network.beams) == len(data["graph"]["beams"])
    np.testing.assert_array_equal(network.reference_point, data["reference_point"])


def test_the_schema_is_one():
    Draft202012Validator.check_schema(network_schema())


@pytest.mark.parametrize("name", ["hexapod", "3-rpr-beams", "six-joint-arm", "star"])
def test_networks_are_written_and_read_back(name):
    file = Path(__file__).parents[1] / "model" / "star-platform.yaml"
    robot = rs.load(file if name == "star" else name)
    network = network_of_snapshot(rs.find_posture(robot).snapshot.one(0))
    text = json.dumps(network_to_data(network))
    again = network_from_document(parse_document(text, file="network.json"))
    K = rs.stiffness(network).K
    assert np.allclose(rs.stiffness(again).K, K, rtol=1e-9, atol=1e-9 * np.abs(K).max())
    assert again.space is network.space


def test_beams_and_welds_are_written():
    network, oracle = graph(GRAPH_NAMES[0])
    again = network_from_document(parse_document(json.dumps(network_to_data(network))))
    K = np.array(oracle["K"])
    assert np.allclose(rs.stiffness(again).K, K, rtol=0, atol=1e-9 * np.abs(K).max())
    with pytest.raises(rs.InputError, match="without compliance"):
        network_to_data(replace(network, beams=(), springs=(), joints=()))


def geared(sum_: dict[str, float], k: float | None) -> Network:
    """A slide with a spring, and on another one a body that slides and turns, geared to it."""
    slide = {"kind": "P", "point": [0, 0, 0], "axis": [1, 0, 0]}
    turn = {"kind": "R", "point": [0, 0.3, 0], "axis": [1, 0, 0]}
    both = [{**slide, "point": [0, 0.3, 0], "k": None}, {**turn, "k": None}]
    graph = {
        "nodes": {"wall": [0, 0, 0], "rack": [0.2, 0, 0], "table": [0, 0.3, 0]},
        "fixed": ["wall"],
        "platform": "table",
        "joints": [
            {"name": "a", "a": "wall", "b": "rack", "dofs": [{**slide, "k": 3e5}]},
            {"name": "b", "a": "wall", "b": "table", "dofs": both},
        ],
        "couplings": [{"name": "gear", "sum": sum_, "k": k}],
    }
    data = {"name": "gear", "reference_point": [0, 0.3, 0], "graph": graph}
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
    assert np.isclose(C[0, 0], r**2 / 3e5 + (0.0 if k is None else 1 / k), rtol=1e-10, atol=0)
    with pytest.raises(rs.NoAnswerError):  # the other motion of the joint is free
        compliance_between(network, table, loads=unit[:, [3 - row]])
