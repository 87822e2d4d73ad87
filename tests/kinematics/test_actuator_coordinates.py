"""Forward kinematics: postures by the coordinates of the actuators."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics.machine_pose import actuator_places
from tests.generators.planted_poses import PoseSpace

ROBOTS = (
    "3-puu",
    "3-rps",
    "3-rrr",
    "capaman",
    "delta",
    "h4",
    "hexapod-pus",
    "orthoglide",
    "us-ups",
)


def drives(posture, robot: rs.Robot) -> np.ndarray:
    """Coordinates of the actuators (N, n)."""
    own = zip(posture.coordinates, actuator_places(robot), strict=True)
    return np.concatenate([q[:, places] for q, places in own], axis=1)


@pytest.mark.parametrize("name", ROBOTS)
def test_actuators_of_a_pose_lead_back_to_it(name: str):
    robot = rs.load(name)
    posture = rs.find_posture(robot, PoseSpace(robot).beside(4, 0.05))
    assert posture.reached.all()
    found = rs.find_posture(robot, rs.ActuatorCoordinates(drives(posture, robot)))
    assert found.reached.all()
    np.testing.assert_allclose(found.pose, posture.pose, atol=1e-10)
    for got, expected in zip(found.coordinates, posture.coordinates, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)


def test_assembly_mode_is_that_of_home_and_another_one_near_given_coordinates():
    robot = rs.load("3-rpr")
    beyond = rs.find_posture(robot, [0.45, 0.35, 0.2])  # across a singularity from home
    q = drives(beyond, robot)[0]
    of_home = rs.stiffness(robot, rs.ActuatorCoordinates(q))
    assert of_home.status == rs.Status.OK
    assert of_home.pose is not None
    assert of_home.pose[5] < -0.1
    np.testing.assert_allclose(drives(rs.find_posture(robot, of_home.pose), robot)[0], q, atol=1e-9)
    close_by = [own[0] + 0.01 for own in beyond.coordinates]
    near = rs.find_posture(robot, rs.ActuatorCoordinates(q), near=close_by)
    np.testing.assert_allclose(near.pose[0], beyond.pose[0], atol=1e-9)


def test_names_and_what_is_left_out_stays_at_home():
    robot = rs.load("hexapod")
    names = rs.actuator_names(robot)
    assert names[0] == "leg1/strut"
    home = rs.find_posture(robot)
    longer = home.coordinates[0][0, 2] + np.array([0.0, 0.01])
    found = rs.find_posture(robot, rs.ActuatorCoordinates({"leg1/strut": longer}))
    np.testing.assert_allclose(found.pose[0], home.pose[0], atol=1e-12)
    assert found.reached.all()
    assert drives(found, robot)[1, 0] == pytest.approx(longer[1])


def test_out_of_reach_is_a_status():
    robot = rs.load("3-rpr")
    q = drives(rs.find_posture(robot), robot)[0]
    far = q.copy()
    far[0] += 2.0
    result = rs.stiffness(robot, rs.ActuatorCoordinates([q, far]))
    assert result.status_codes[0] == int(rs.Status.OK)
    assert result.status_codes[1] == int(rs.Status.UNREACHABLE)
    assert rs.stiffness(robot, rs.ActuatorCoordinates(far)).advice


def test_limits_of_drives_are_a_status():
    robot = rs.load("hexapod")
    q = drives(rs.find_posture(robot), robot)[0] + 0.45
    assert rs.Status.BEYOND_LIMITS in rs.stiffness(robot, rs.ActuatorCoordinates(q)).status


def test_numbers_that_are_those_of_the_home_pose_are_no_pose():
    robot = rs.load("gough-stewart-b")
    home = rs.find_posture(robot).pose[0]
    rs.stiffness(robot, np.tile(home, (7000, 1)))  # the record of the robot is made
    assert rs.stiffness(robot, rs.ActuatorCoordinates(home)).status == rs.Status.UNREACHABLE


def test_all_joints_of_an_arm_are_actuators():
    arm = rs.load("six-joint-arm")
    q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    found, expected = (
        rs.stiffness(arm, given(q)) for given in (rs.ActuatorCoordinates, rs.JointCoordinates)
    )
    np.testing.assert_array_equal(found.K, expected.K)


def test_a_crank_that_may_stand_anywhere_stands_where_it_is_given():
    robot = rs.load("agile-eye")
    q = drives(rs.find_posture(robot), robot)[0]
    posture = rs.find_posture(robot, rs.ActuatorCoordinates(q))
    assert not posture.undetermined.any()
