"""Robots by name, as robots."""

import robostiff as rs


def shipped(name: str) -> rs.Robot:
    """A shipped robot."""
    robot = rs.load(name)
    assert isinstance(robot, rs.Robot)
    return robot


def with_symbols(name: str) -> rs.Robot:
    """A shipped robot whose parameters are symbols."""
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    assert isinstance(robot, rs.Robot)
    return robot
