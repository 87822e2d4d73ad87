"""Shipped robots that can move."""

from collections.abc import Mapping

import robostiff as rs


def loaded(name: str, parameters: Mapping[str, float] | None = None) -> rs.Robot:
    robot = rs.load(name, parameters)
    assert isinstance(robot, rs.Robot)
    return robot
