"""Robots by name, as robots."""

import robostiff as rs


def shipped(name: str) -> rs.Robot:
    """A shipped robot."""
    robot = rs.load(name)
    assert isinstance(robot, rs.Robot)
    return robot
