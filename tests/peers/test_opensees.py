"""Shipped robots at general poses against OpenSees, a program for structures that knows no robots.

Both get the same parts in the same places; what is compared is how they are put together. Stiff
springs in place of joints cost OpenSees digits twice: by what is compliant in them, of which
extrapolation leaves little, and by rounding beside numbers a hundred thousand times larger.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff import JointCoordinates, Leg, Linear, Robot, compliance, load, modes, stiffness
from robostiff.cli.main import app
from robostiff.elasticity import (
    BeamSegment,
    beam_compliance,
    elasticity_from_compliance,
    tapered_compliance,
)
from robostiff.kinematics import PostureFinder
from robostiff.model import Actuated, Chain, Link, PlacedMass, revolute
from robostiff.network import Node, beam_between, network_of_snapshot
from robostiff_interop import opensees_script
from tests.cases.metric import distance
from tests.network.frames import graph
from tests.peers.opensees import (
    bodies_in_opensees,
    columns_of_script,
    frequencies_by_opensees,
    loaded_frame,
    stiffness_by_opensees,
)
from tests.robots.test_every_robot import random_poses

STAR = str(Path(__file__).parents[1] / "model" / "star-platform.yaml")
# What joints of stiff springs leave of the digits: the least of them at poses near singular ones.
AGREEMENT = {
    "gough-stewart-b-beams": 1e-11,
    "hexapod": 1e-8,
    "3-puu": 3e-8,
    "3-rpr-beams": 1e-9,
    "3-rrr": 1e-9,
    "six-joint-arm": 1e-8,
    "two-link-arm": 1e-9,
    "tripteron": 1e-8,
    STAR: 1e-9,
}

pytestmark = pytest.mark.needs("OpenSees")


@pytest.mark.parametrize("name", AGREEMENT, ids=lambda name: Path(name).stem)
def test_robot_at_a_general_pose(name, by_opensees):
    robot = load(name)
    finder = PostureFinder(robot)
    if robot.is_serial:
        home = robot.legs[0].chain.home
        pose = JointCoordinates(home + np.random.default_rng(3).uniform(-1, 1, len(home)))
    else:
        pose = random_poses(robot.name, finder, 2)[0]
    network = network_of_snapshot(finder.find(pose).snapshot.one(0))
    K = stiffness(robot, pose).K
    assert distance(by_opensees(stiffness_by_opensees, network), K) < AGREEMENT[name]


@pytest.mark.parametrize("name", ["3-rrr", "hexapod", "six-joint-arm"])
def test_natural_frequencies_of_a_robot(name, by_opensees):
    """Points of mass where the parts of the legs meet, and on the platform."""
    robot = load(name)
    finder = PostureFinder(robot)
    start = robot.legs[0].chain.home + 0.4 if robot.is_serial else None
    pose = JointCoordinates(start) if start is not None else random_poses(name, finder, 2)[0]
    network = network_of_snapshot(finder.find(pose).snapshot.one(0))
    points, random = bodies_in_opensees(network), np.random.default_rng(5)
    moving = sorted(set(points) - set(network.fixed))
    masses = dict(zip(moving, random.uniform(1, 9, len(moving)).tolist(), strict=True))
    nodes = tuple(
        replace(
            node, masses=(PlacedMass(node.name, np.asarray(masses[node.name]), points[node.name]),)
        )
        if node.name in masses
        else node
        for node in network.nodes
    )
    found = modes(replace(network, nodes=nodes), gravity=[0, 0, 0], beams=Linear()).frequencies
    expected = by_opensees(frequencies_by_opensees, network, masses)
    assert np.allclose(found, expected, rtol=1e-6)


def test_loops_inside_legs(by_opensees):
    network, oracle = graph("h_orthoglide_pose0")
    K = np.array(oracle["K"])
    assert distance(by_opensees(stiffness_by_opensees, network), K) < 1e-8
    assert distance(stiffness(network).K, K) < 1e-12


@pytest.mark.parametrize(
    ("name", "suffix", "left"), [("hexapod", "tcl", 3e-6), ("gough-stewart-b-beams", "py", 6e-5)]
)
def test_written_models_run(by_opensees, name, suffix, left, tmp_path):
    """Springs a hundred thousand times as stiff as the stiffest part stand for rigid joints."""
    if suffix == "tcl":
        pytest.importorskip("tkinter")
    path = tmp_path / f"model.{suffix}"
    asked = ["convert", name, "--to", "opensees", "-o", str(path)]
    assert CliRunner().invoke(app, asked).exit_code == 0
    C = by_opensees(columns_of_script, path)
    expected = compliance(load(name))
    assert distance(C, expected) < left
    assert distance(C, expected) > 1e-9  # or it is not what was written that was computed


def test_frame_with_loaded_beams_and_a_foot_that_settles(by_opensees):
    """A table of four beams on three feet, none of them along the world's axes."""
    section = rs.CrossSection(4e-4, 1.2e-8, 3.1e-8, 2.5e-8, 0.85, 0.7)
    points = {"a": [0, 0, 0], "b": [1, 0.2, 0], "c": [0.3, 1, 0.1], "top": [0.4, 0.3, 0.9],
              "tip": [1.1, 0.7, 1.2]}  # fmt: skip
    nodes = {name: Node(name, np.array(p, dtype=float)) for name, p in points.items()}
    beams = tuple(
        beam_between(nodes[a], nodes[b], rs.material("steel"), section, name=a + b)
        for a, b in (("a", "top"), ("b", "top"), ("c", "top"), ("top", "tip"))
    )
    frame = rs.Network("table", tuple(nodes.values()), ("a", "b", "c"), "tip", nodes["tip"].point,
                    beams=beams)  # fmt: skip
    q, t = np.array([30.0, -80, 55]), np.array([1e-3, -2e-3, 5e-4, 1e-3, 2e-3, -1e-3])
    loads = {beam.name: rs.DistributedForce(beam.rotation @ q) for beam in beams}
    found = rs.network_response(frame, loads, settlements={"c": t})
    for name, twist in by_opensees(loaded_frame, frame, q, "c", t).items():
        assert np.allclose(found.twists[name], twist, rtol=1e-9, atol=1e-12)


UNEVEN = rs.CrossSection(A=1e-3, Iy=4e-7, Iz=1e-7, J=2e-7), rs.CrossSection(1e-3, 1e-7, 2e-7, 2e-7)


@pytest.mark.parametrize("off", ["taper", "measured"])
def test_matrices_that_are_no_beam_are_no_beam_in_opensees(off):
    """A uniform beam has three numbers more than these matrices agree with."""
    steel = rs.material("steel")
    if off == "taper":
        segments = [BeamSegment(0.5, steel, section) for section in UNEVEN]
        C = tapered_compliance(segments)
    else:
        C = beam_compliance(1.0, steel, UNEVEN[0])
        C[0, 4] = C[4, 0] = 0.3 * np.sqrt(C[0, 0] * C[4, 4])
    link = Link(np.array([1.0, 0, 0]), elasticity_from_compliance(C), np.eye(3), "arm")
    turn = revolute([0, 0, 1], Actuated(1e5), name="hinge")
    arm = Robot("arm", (Leg("arm", rs.Frame.identity(), Chain((turn, link)), rs.Frame.identity()),))
    network = network_of_snapshot(PostureFinder(arm).find(None).snapshot.one(0))
    with pytest.raises(rs.InputError, match="a uniform beam, or a spring along its own axes"):
        opensees_script(network)
