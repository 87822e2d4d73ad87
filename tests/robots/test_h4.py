"""The H4: freedoms, what its bars do, and why its arms come from three sides."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elastostatics import Status
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import PostureFinder
from robostiff.model import PlacedBlock, Robot
from robostiff.robots import robot_file
from tests.cases.metric import distance
from tests.robots.test_architectures import freedoms_between
from tests.robots.test_every_robot import random_poses, shipped

HALF_CROSSBAR = 0.06  # m
MIRROR = np.diag([-1.0, 1, 1, 1, -1, -1])  # x to -x, for twists


@pytest.fixture(scope="module")
def posture():
    finder = PostureFinder(shipped("h4"))
    return finder.find(np.vstack([finder.home_pose, random_poses("h4", finder, 20)]))


def test_four_freedoms_and_no_constraint_too_many(posture):
    """A pair of arms resists a couple for each arm; its hinge passes one of the two on."""
    assert posture.reached.all()
    for i in range(len(posture.pose)):
        snapshot = posture.snapshot.one(i)
        free, surplus = freedoms_between(snapshot.legs, snapshot.reference_point)
        assert (free.shape[1], surplus) == (4, 0)
        for leg in snapshot.legs:
            (block,) = (e for e in leg.elements if isinstance(e, PlacedBlock))
            bar, _ = freedoms_between(block.branches, snapshot.reference_point)
            assert bar.shape[1] == 4


def test_bars_translate_and_the_crossbar_turns_between_them(posture):
    """Pierrot and Company: hinges follow the turn, and their middle is the platform."""
    hinges = np.stack([list(leg.freedoms)[-1].point for leg in posture.snapshot.legs])
    turn = posture.pose[:, 5]
    across = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    np.testing.assert_allclose(hinges.mean(axis=0), posture.pose[:, :3], atol=1e-12)
    np.testing.assert_allclose(hinges[0] - hinges[1], 2 * HALF_CROSSBAR * across, atol=1e-12)
    for q in posture.coordinates:
        np.testing.assert_allclose(q[:, -1], turn, atol=1e-10)


def test_home_is_symmetric_about_the_plane_between_the_bars():
    K = rs.stiffness(shipped("h4")).K
    assert distance(MIRROR @ K @ MIRROR, K) < 1e-12


def from_four_sides() -> str:
    """The model file with its two pairs opposite to each other."""
    text = robot_file("h4").read_text()
    for old, new in [
        ("at_y: d, end_y: d", "at_y: side*d, end_y: side*d"),
        ("at_y: -(d + R), end_y: -d", "at_y: -side*(d + R), end_y: -side*d"),
        ("azimuth: -90 deg", "azimuth: -side*90 deg"),
        ("coordinates: [x, y, z, rz]", ""),
    ]:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def test_with_arms_from_four_sides_the_nacelle_could_tilt():
    """Both pairs then resist the same couple, along the lines across their middle."""
    robot = model_from_document(parse_document(from_four_sides()))
    assert isinstance(robot, Robot)
    assert len(robot.coordinates) == 5
    result = rs.stiffness(robot)
    assert result.status == Status.FREE_MOTIONS
    snapshot = rs.find_posture(robot).snapshot.one(0)
    turned = Rotation.from_euler("z", 180, degrees=True).as_matrix()
    R = np.kron(np.eye(2), turned)
    assert distance(R @ result.K @ R.T, result.K) < 1e-12
    free, _ = freedoms_between(snapshot.legs, snapshot.reference_point)
    assert free.shape[1] == 5
