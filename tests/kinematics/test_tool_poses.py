"""Poses by tip and axis of the tool."""

import numpy as np
import pytest

import robostiff as rs
from tests.project.shown_output import ROOT


@pytest.fixture(scope="module")
def machine() -> rs.Robot:
    return rs.load(str(ROOT / "examples/tricept-with-head.yaml"))


TIPS = np.array([[0.1, 0.05, -1.6], [0.0, 0.2, -1.7]])
AXES = np.array([[0.2, 0.1, 1.0], [0.0, -0.6, 2.0]])


def test_tip_and_axis_are_where_they_were_given(machine):
    result = rs.stiffness(machine, rs.ToolPose(TIPS, AXES))
    assert np.all(result.status_codes == 0)
    transform = result.transform
    np.testing.assert_allclose(transform.translation, TIPS, atol=1e-9)
    unit = AXES / np.linalg.norm(AXES, axis=1, keepdims=True)
    np.testing.assert_allclose(transform.rotation.as_matrix()[:, :, 2], unit, atol=1e-9)


def test_stiffness_is_that_of_the_whole_pose(machine):
    by_axis = rs.stiffness(machine, rs.ToolPose(TIPS[0], AXES[0]))
    again = rs.stiffness(machine, by_axis.transform)
    np.testing.assert_allclose(by_axis.K, again.K, atol=1e-9 * np.abs(again.K).max())


def test_tip_is_the_reference_point():
    robot = rs.load(str(ROOT / "examples/tricept.yaml"))
    home = rs.stiffness(robot)
    result = rs.stiffness(robot, rs.ToolPose(home.reference_point, [0, 0, 1]))
    np.testing.assert_allclose(result.pose, home.pose, atol=1e-9)


def test_a_machine_of_three_freedoms_does_not_reach_any_axis():
    robot = rs.load(str(ROOT / "examples/tricept.yaml"))
    assert rs.stiffness(robot, rs.ToolPose([0, 0, -1.45], [0, 1, 1])).status == (
        rs.Status.UNREACHABLE
    )


def test_six_freedoms_turn_the_shortest_way_then_spin():
    robot = rs.load("hexapod")
    tilted = rs.ToolPose([0, 0, 0.9], [0, np.sin(0.1), np.cos(0.1)])
    np.testing.assert_allclose(
        rs.find_posture(robot, tilted).pose[0], [0, 0, 0.9, -0.1, 0, 0], atol=1e-12
    )
    spun = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, 3], spin=[0.0, 0.2]))
    np.testing.assert_allclose(spun.pose[1], [0, 0, 0.9, 0, 0, 0.2], atol=1e-12)
    np.testing.assert_allclose(spun.pose[0], [0, 0, 0.9, 0, 0, 0.0], atol=1e-12)


def test_opposite_axis_is_a_half_turn():
    robot = rs.load("hexapod")
    R = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, -1])).snapshot
    assert R is not None
    pose = rs.find_posture(robot, rs.ToolPose([0, 0, 0.9], [0, 0, -1])).pose[0]
    assert np.linalg.norm(pose[3:]) == pytest.approx(np.pi)
    assert pose[5] == pytest.approx(0.0, abs=1e-9)


def test_another_axis_of_the_platform(machine):
    result = rs.stiffness(machine, rs.ToolPose([0, 0, -1.65], [0, 1, 0.1], tool_axis=[0, 1, 0]))
    R = result.transform.rotation.as_matrix()
    np.testing.assert_allclose(R[:, 1], np.array([0, 1, 0.1]) / np.hypot(1, 0.1), atol=1e-9)


@pytest.mark.parametrize("x", [0.2, -0.2, 0.6])
def test_a_head_that_stands_upright_turns_before_it_tilts_across_its_axis(machine, x: float):
    """Its axes are in the plane of the wanted one, so that no small motion leads there."""
    result = rs.stiffness(machine, rs.ToolPose([0.05, 0, -1.6], [x, 0, 1]))
    assert result.status == rs.Status.OK
    unit = np.array([x, 0, 1]) / np.hypot(x, 1)
    axis = result.transform.rotation.as_matrix()[:, 2]
    np.testing.assert_allclose(axis, unit, rtol=0, atol=1e-9)
    turned, tilted = result.joint_coordinates["machine"][-2:]
    assert abs(turned) == pytest.approx(np.pi / 2, abs=1e-9)
    assert abs(tilted) > 0.05


def test_coordinates_of_a_result_choose_its_posture_again(machine):
    pose = rs.ToolPose([0.05, 0, -1.6], [0.2, 0, 1])
    result = rs.stiffness(machine, pose)
    q = dict(result.joint_coordinates)
    for near in (q, {"machine": q["machine"].tolist()}):
        again = rs.stiffness(machine, pose, near=near)
        np.testing.assert_allclose(again.K, result.K, rtol=0, atol=1e-9 * np.abs(result.K).max())
        found = rs.find_posture(machine, pose, near=near).coordinates[0][0]
        np.testing.assert_allclose(found, q["machine"], rtol=0, atol=1e-9)
    legs = rs.stiffness(rs.load("3-rrr")).joint_coordinates
    assert rs.stiffness(rs.load("3-rrr"), near=legs).status == rs.Status.OK
    for wrong in ({}, {"machine": q["machine"], "other": [0.0]}, {"machine": [0.0]}):
        with pytest.raises(rs.InputError, match="near of 'tricept with head'"):
            rs.stiffness(machine, pose, near=wrong)
