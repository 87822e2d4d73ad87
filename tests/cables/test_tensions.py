"""Tensions balance the wrench within limits, and are the ones that a rule promises.

That the nearest ones exist where a linear program finds any, and are nearest, is in maps of cables.
"""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from tests.cables.machines import cable_robot, random_robot

STATUS = rs.Status


def test_nearest_tensions_of_fewer_cables_than_freedoms():
    robot = cable_robot("cable-3-suspended")
    answer = rs.cable_tensions(robot)
    np.testing.assert_allclose(answer.tensions, 100 * np.sqrt(0.8**2 + 2**2) / 2, rtol=1e-12)
    assert rs.cable_tensions(robot, wrench=[1, 0, 0, 0, 0, 0]).status == STATUS.INFEASIBLE


def test_closed_form_is_the_nearest_where_no_limit_is_met():
    robot = cable_robot("cable-8")
    closed = rs.cable_tensions(robot, tensions=rs.ClosedFormTensions(0.5))
    nearest = rs.cable_tensions(robot, tensions=rs.NearestTensions(0.5))
    np.testing.assert_allclose(closed.tensions, nearest.tensions, rtol=1e-9)


def test_closed_form_answers_within_limits_or_says_so():
    robot = cable_robot("cable-8")
    rng = np.random.default_rng(1)
    poses = [0, 0, 1, 0, 0, 0] + rng.uniform(-1, 1, (400, 6)) * [1.8, 1.3, 0.9, 0.1, 0.1, 0.1]
    closed = rs.cable_tensions(robot, poses, tensions=rs.ClosedFormTensions())
    nearest = rs.cable_tensions(robot, poses, tensions=rs.NearestTensions(0.5))
    failed = (closed.status_codes & STATUS.FORM_DOES_NOT_HOLD) > 0
    assert (closed.feasible | failed).tolist() == nearest.feasible.tolist()
    assert closed.feasible.sum() > 50
    t = closed.values[closed.feasible]
    assert (t > 50 - 1e-6).all()
    assert (t < 720 + 1e-6).all()
    result = rs.cable_stiffness(robot, poses[closed.feasible], tensions=rs.ClosedFormTensions())
    assert np.abs(result.missing_wrench).max() < 1e-6


@pytest.mark.parametrize("level", [0.0, 0.3, 1.0])
def test_tensions_balance_weight_and_wrench(level):
    robot, wrench = cable_robot("cable-8"), [30.0, -20, 50, 1, 0.5, -0.3]
    result = rs.cable_stiffness(robot, wrench=wrench, tensions=rs.NearestTensions(level))
    np.testing.assert_allclose(result.missing_wrench, 0, atol=1e-9)


def test_given_tensions_that_do_not_balance_are_said_to():
    robot = cable_robot("cable-4-planar")
    result = rs.cable_stiffness(robot, tensions=rs.GivenTensions([100, 100, 100, 100.0]))
    assert result.status == STATUS.UNBALANCED
    np.testing.assert_allclose(result.missing_wrench, [0, 20, 0], atol=1e-9)
    balanced = rs.GivenTensions(rs.cable_tensions(robot).tensions)
    assert rs.cable_stiffness(robot, tensions=balanced).status == STATUS.OK
    beyond = rs.cable_stiffness(robot, tensions=rs.GivenTensions([1000, 100, 100, 100.0]))
    assert STATUS.BEYOND_LIMITS in beyond.status


def test_tensions_of_the_file_are_used():
    robot = random_robot(3)
    t = rs.cable_tensions(robot, wrench=np.zeros(6), tensions=rs.NearestTensions())
    assert t.rule == "nearest"
    given = replace(robot, cables=tuple(replace(c, tension=77.0) for c in robot.cables))
    assert rs.cable_tensions(given).values.tolist() == [77.0] * 8


def test_pose_without_tensions_is_a_status_and_its_numbers_an_exception():
    robot = cable_robot("cable-8")
    poses = [[0, 0, 1, 0, 0, 0], [0, 0, 3.0, 0, 0, 0], [1.94, 1.44, 2, 0, 0, 0]]
    result = rs.stiffness(robot, poses)
    assert [str(rs.Status(int(c))) for c in result.status_codes] == [
        "ok",
        "infeasible",
        "unreachable",
    ]
    assert result.answered.tolist() == [True, False, False]
    assert result.rank.tolist() == [6, -1, -1]
    assert np.isfinite(result[result.answered].K).all()


@pytest.mark.parametrize("seed", [5, 52, 76])
def test_closed_form_takes_no_rounding_at_a_limit_for_a_violation(seed):
    """Without a load tensions of zero lie at their limits, in a batch as at each pose."""
    robot = random_robot(seed, 9, weight=False)
    loose = tuple(replace(own, least_tension=0.0) for own in robot.cables)
    robot = replace(robot, cables=loose)
    poses = np.random.default_rng(seed).uniform(-0.5, 0.5, (40, 6))
    rule = rs.ClosedFormTensions(0.5)
    whole = rs.cable_tensions(robot, poses, tensions=rule)
    for pose, code in zip(poses, whole.status_codes, strict=True):
        assert int(rs.cable_tensions(robot, pose, tensions=rule).status) == code
