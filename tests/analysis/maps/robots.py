"""Shipped robots that can move."""

import robostiff as rs


def loaded(name: str) -> rs.Robot:
    robot = rs.load(name)
    assert isinstance(robot, rs.Robot)
    return robot
