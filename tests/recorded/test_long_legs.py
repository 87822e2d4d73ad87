"""Records of long legs: they grow as the leg does, and a budget of operations ends them."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import posed_stiffness
from robostiff.errors import NoAnswerError
from robostiff.kinematics import posture_finder
from robostiff.model import Actuated, Chain, Leg, Rigid, Robot, revolute
from robostiff.recorded import RecordedRobot, record_robot
from robostiff.spatial import Frame


def arm(count: int) -> Robot:
    """A snake of so many elastic turns."""
    elements = []
    for i in range(count):
        axis, home = np.eye(3)[2 - i % 3], np.radians((7 * i) % 11 - 5)
        elements.append(revolute(axis, Actuated(4e5), home=[home], name=f"j{i}"))
        elements.append(Rigid(Frame(np.eye(3), np.array([0.02, 0.005, 0]))))
    leg = Leg("snake", Frame.identity(), Chain(tuple(elements)), Frame.identity())
    return Robot("snake", (leg,))


def recorded(robot: Robot, most: int | None = None) -> RecordedRobot:
    return record_robot(robot, posture_finder(robot), most)


def test_a_record_grows_no_faster_than_its_leg():
    sizes = [recorded(arm(count)).record.size for count in (6, 12, 24)]
    assert sizes[1] < 2.2 * sizes[0]
    assert sizes[2] < 2.2 * sizes[1]


def test_a_long_record_says_what_the_direct_form_says():
    robot = arm(24)
    pose = rs.JointCoordinates(robot.legs[0].chain.home + 0.01 * np.arange(72).reshape(3, 24))
    answer, sure = (
        rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(pose),
        rs.stiffness(robot, pose),
    )
    assert not answer.guarded.any()
    assert np.allclose(answer.values["K"], sure.K, rtol=1e-9, atol=1e-9 * np.abs(sure.K).max())


def test_a_record_is_given_up_beyond_its_budget(monkeypatch: pytest.MonkeyPatch):
    robot = arm(8)
    size = recorded(robot).record.size
    assert recorded(robot, size).record.size == size
    with pytest.raises(NoAnswerError, match=f"more than {size - 1} operations"):
        recorded(robot, size - 1)
    monkeypatch.setattr(posed_stiffness, "_MOST_OPERATIONS", size // 2)
    kept = posed_stiffness.record_of(robot)
    assert kept.for_poses(10**6, (250, 6000, 2**20)) is None
    assert kept.is_tried
    K = rs.stiffness(robot).K
    assert np.array_equal(rs.stiffness(robot).K, K)
