"""Shipped robots at general poses against OpenSees, a program for structures that knows no robots.

Both get the same parts in the same places; what is compared is how they are put together. Stiff
springs in place of joints cost OpenSees digits twice: by what gives way in them, of which
extrapolation leaves little, and by rounding beside numbers a hundred thousand times larger.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from robostiff import JointCoordinates, Robot, load, stiffness
from robostiff.kinematics import PostureFinder
from robostiff.network import network_of_snapshot
from tests.generators.metric import distance
from tests.network.frames import GRAPH_NAMES, graph
from tests.peers.opensees import opensees, stiffness_by_opensees
from tests.robots.test_every_robot import random_poses

try:
    opensees()
except ImportError as error:
    pytest.skip(f"OpenSees cannot be loaded here: {error}", allow_module_level=True)

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
FRAMES = [name for name in GRAPH_NAMES if not graph(name)[0].joints]


@pytest.mark.parametrize("name", AGREEMENT, ids=lambda name: Path(name).stem)
def test_robot_at_a_general_pose(name):
    robot = load(name)
    assert isinstance(robot, Robot)
    finder = PostureFinder(robot)
    if robot.is_serial:
        home = robot.legs[0].chain.home
        pose = JointCoordinates(home + np.random.default_rng(3).uniform(-1, 1, len(home)))
    else:
        pose = random_poses(robot.name, finder, 2)[0]
    network = network_of_snapshot(finder.find(pose).snapshot.one(0))
    K = stiffness(robot, pose).K
    assert distance(stiffness_by_opensees(network), K) < AGREEMENT[name]


@pytest.mark.parametrize("name", FRAMES)
def test_frame_of_beams(name):
    network, oracle = graph(name)
    K = np.array(oracle["K"])
    assert distance(stiffness_by_opensees(network), K) < 1e-9
