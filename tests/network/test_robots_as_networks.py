"""Every shipped robot as a network, against the wrench basis form leg by leg."""

import numpy as np
import pytest

from robostiff.analysis import stiffness
from robostiff.analysis.verification import matrix_distance
from robostiff.elasticity import Elasticity
from robostiff.kinematics import JointCoordinates, Pose, PostureFinder
from robostiff.model import PlacedLeg, PlacedSpring, Robot, Snapshot
from robostiff.network import energy_stiffness, network_of_snapshot
from robostiff.robots import load, shipped_robots
from tests.cases.metric import distance
from tests.cases.reference_case import NAMES, case
from tests.robots.test_every_robot import random_poses


def poses_of(robot: Robot, count: int) -> Pose:
    if not robot.is_serial:
        poses = random_poses(robot.name, PostureFinder(robot), count)
        return poses[:, robot.coordinate_places]
    chain = robot.legs[0].chain
    room = [1.0 if f.turns else 0.05 for f in chain.freedoms]
    steps = np.random.default_rng(3).uniform(-1, 1, (count, chain.size)) * room
    return JointCoordinates(chain.home + steps)


@pytest.mark.parametrize("count", [2, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", shipped_robots())
def test_robot_at_random_poses(name, count):
    robot = load(name)
    assert isinstance(robot, Robot)
    poses = poses_of(robot, count)
    expected = stiffness(robot, poses)
    snapshot = PostureFinder(robot).find(poses).snapshot
    assert len(expected.rank) == count
    for i in range(count):
        result = stiffness(network_of_snapshot(snapshot.one(i)))
        size = float(expected[i].length)
        assert matrix_distance(result.K, expected[i].K, size) < 1e-9
        assert result.status == expected[i].status
        assert result.rank == expected[i].rank
        assert len(result.free_motions) == len(expected[i].free_motions)
        assert set(result.redundant_joints) == set(expected[i].redundant_joints)


@pytest.mark.parametrize("name", NAMES)
def test_reference_case_against_sixty_digits(name):
    given = case(name)
    network = network_of_snapshot(given.snapshot)
    result = stiffness(network)
    assert distance(result.K, given.K, given.size) < 1e-12
    assert int(result.rank) == given.oracle["rank"]
    assert set(result.redundant_joints) == set(stiffness(given.snapshot).redundant_joints)
    assert distance(energy_stiffness(network), given.K, given.size) < 1e-10


def test_a_spring_with_free_and_rigid_directions():
    C = np.diag([1e-6, 0, 2e-6, 0, 3e-4, 0])
    free = np.eye(6)[:, [3]]
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    far = np.array([0.3, 0.2, 0.9])
    soft = PlacedSpring("soft", far / 2, np.eye(3), Elasticity(1e-7 * np.eye(6)))
    odd = PlacedSpring("odd", far, turn, Elasticity(C, free))
    snapshot = Snapshot("mount", (PlacedLeg("leg", (soft, odd), far),), far)
    network = network_of_snapshot(snapshot)
    expected, result = stiffness(snapshot), stiffness(network)
    assert int(result.rank) == int(expected.rank) == 5
    assert matrix_distance(result.K, expected.K, 0.5) < 1e-12
    assert matrix_distance(energy_stiffness(network), expected.K, 0.5) < 1e-10
