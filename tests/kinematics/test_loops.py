"""Loops inside legs, and poses that are given by actuator coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import PostureFinder
from robostiff.kinematics.machine_pose import actuator_places
from robostiff.model import Chain, Leg, ParallelBlock, Robot
from robostiff.robots import load
from robostiff.spatial import Frame
from tests.generators.elements import shift_by
from tests.generators.kernel_robots import robot_called
from tests.generators.planted_poses import PoseSpace

COPIES = ("orthoglide", "delta", "nested parallelograms")
ITERATED = ("four-bar legs", "pairs of struts")


def robot_of(name: str) -> Robot:
    robot = robot_called(name)
    return robot


def after(first: Frame, second: Frame) -> Frame:
    """The second frame, seen from where the first is seen."""
    return Frame(first.R @ second.R, first.p + first.R @ second.p)


@pytest.mark.parametrize("name", COPIES + ITERATED)
def test_loops_close_at_random_poses(name):
    robot = robot_of(name)
    posture = rs.find_posture(robot, PoseSpace(robot).beside(20, 0.08))
    assert posture.reached.all()
    assert posture.meets(1e-11).all()


@pytest.mark.parametrize("name", COPIES + ITERATED)
def test_the_way_to_close_is_the_one_that_holds(name):
    solvers = PostureFinder(robot_of(name)).solvers
    closed = [solver.closed_form is not None for solver in solvers]
    # The slide and rod of a nested parallelogram have no platform joint: no closed form either.
    assert all(closed) if name in ("orthoglide", "delta") else not any(closed)


def test_copies_that_turn_against_each_other_are_closed_by_iteration():
    """Struts in pairs reach a turned platform, though equal coordinates would not."""
    robot = robot_of("pairs of struts")
    apart = Robot(
        "six struts",
        tuple(
            Leg(f"{leg.name} {branch.name}", after(leg.base, branch.start), branch.chain,
                after(leg.attachment, branch.end))
            for leg in robot.legs
            for block in leg.chain.elements
            if isinstance(block, ParallelBlock)
            for branch in block.branches
        ),
        home=robot.home,
    )  # fmt: skip
    pose = [0.02, 0.01, 0.6, 0.1, 0.05, -0.07]
    first, second = rs.stiffness(robot, pose), rs.stiffness(apart, pose)
    assert np.abs(first.K - second.K).max() < 1e-9 * np.abs(second.K).max()


def test_poses_may_have_different_freedoms_in_different_chunks():
    """Where a parallelogram lies flat it has one freedom more."""
    robot = load("orthoglide")
    poses = np.zeros((4097, 3))
    poses[-1] = [0, 0, 0.6]
    result = rs.stiffness(robot, poses)
    alone = rs.stiffness(robot, poses[-1])
    assert int(result.rank[0]) == 6
    assert int(result.rank[-1]) == int(alone.rank) == 5
    assert result[4096].redundant_joints == alone.redundant_joints


def test_branches_without_joints_are_one_stiff_part():
    """Two bars welded between two bodies: they stretch as one of twice the stiffness."""
    block = next(e for e in robot_of("orthoglide").legs[0].chain.elements if e.name[:5] == "paral")
    assert isinstance(block, ParallelBlock)
    bar = block.branches[0].chain.elements[1]
    welded = replace(block, branches=tuple(replace(b, chain=Chain((bar,))) for b in block.branches))
    here = shift_by(0, 0, 0)
    home = shift_by(0.6, 0, 0)
    alone, pair = (
        rs.stiffness(Robot("arm", (Leg("arm", here, Chain((e,)), here),), home=home))
        for e in (bar, welded)
    )
    assert int(pair.rank) == 6
    assert pair.K[0, 0] == pytest.approx(2 * alone.K[0, 0], rel=1e-12)


ROBOTS = (
    "3-puu", "3-rps", "3-rrr", "capaman", "delta", "h4", "hexapod-pus", "orthoglide", "us-ups",
)  # fmt: skip


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
