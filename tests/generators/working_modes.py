"""Robots in other working modes."""

from dataclasses import replace

import robostiff as rs


def with_elbows(robot: rs.Robot, elbow: rs.Elbow, *names: str) -> rs.Robot:
    """The same robot with the elbow of all legs, or of those named, to one side."""
    chosen = names or [leg.name for leg in robot.legs]
    legs = (replace(leg, elbow=elbow) if leg.name in chosen else leg for leg in robot.legs)
    return replace(robot, legs=tuple(legs))
