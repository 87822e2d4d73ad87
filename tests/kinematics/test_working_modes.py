"""Working modes of a whole robot."""

import numpy as np

import robostiff as rs


def puu() -> rs.Robot:
    robot = rs.load("3-puu")
    return robot


def test_both_working_modes_reach_the_pose_with_different_stiffness():
    up = puu()
    down = up.with_elbows(rs.Elbow.MINUS)
    pose = [0.05, 0.02, 0.3]
    high, low = rs.find_posture(up, pose), rs.find_posture(down, pose)
    assert high.reached.all()
    assert low.reached.all()
    for q_high, q_low in zip(high.coordinates, low.coordinates, strict=True):
        assert q_high[0, 0] > 0.3 > q_low[0, 0]
    difference = rs.stiffness(up, pose).K - rs.stiffness(down, pose).K
    assert np.abs(difference).max() > 1e3


def test_one_leg_alone_can_change():
    mixed = puu().with_elbows({"leg2": rs.Elbow.MINUS})
    slides = [q[0, 0] for q in rs.find_posture(mixed, [0, 0, 0.3]).coordinates]
    assert slides[0] > 0.3
    assert slides[1] < 0.3
    assert slides[2] > 0.3
