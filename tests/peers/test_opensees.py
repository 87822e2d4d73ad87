"""Shipped robots at general poses against OpenSees, a program for structures that knows no robots.

Both get the same parts in the same places; what is compared is how they are put together. Stiff
springs in place of joints cost OpenSees digits twice: by what is compliant in them, of which
extrapolation leaves little, and by rounding beside numbers a hundred thousand times larger.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from robostiff import JointCoordinates, Robot, load, stiffness
from robostiff.kinematics import PostureFinder
from robostiff.network import Network, network_of_snapshot
from tests.generators.metric import distance
from tests.network.frames import graph
from tests.peers.opensees import load_opensees, silence, stiffness_by_opensees
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


@pytest.fixture(scope="module")
def by_opensees() -> Iterator[Callable[[Network], np.ndarray]]:
    """OpenSees in a process of its own, where nobody reads what it prints as it ends."""
    spawned = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawned, initializer=silence) as process:
        try:
            process.submit(load_opensees).result()
        except ImportError as error:
            pytest.skip(f"OpenSees cannot be loaded here: {error}")
        yield lambda network: process.submit(stiffness_by_opensees, network).result()


@pytest.mark.parametrize("name", AGREEMENT, ids=lambda name: Path(name).stem)
def test_robot_at_a_general_pose(name, by_opensees):
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
    assert distance(by_opensees(network), K) < AGREEMENT[name]


def test_loops_inside_legs(by_opensees):
    network, oracle = graph("h_orthoglide_pose0")
    K = np.array(oracle["K"])
    assert distance(by_opensees(network), K) < 1e-8
    assert distance(stiffness(network).K, K) < 1e-12
