"""Answers that several tests draw."""

from functools import cache
from typing import Any

import numpy as np

import robostiff as rs

POSE = (0.06, 0.02, 0.9, 0, 0.17, 0)
HERE = rs.Frame(np.eye(3), np.zeros(3))
LOAD = (300, 100, -200, 0, 0, 20)


@cache
def robot(name: str) -> Any:
    return rs.load(name)


@cache
def hexapod_stiffness() -> rs.RobotStiffness:
    return rs.stiffness(robot("hexapod"), POSE)


@cache
def hexapod_deflection() -> rs.Deflection:
    return rs.deflection(robot("hexapod"), POSE, LOAD)


@cache
def tripod_map() -> Any:
    """Reachable and unreachable poses of a translational tripod."""
    grid = rs.Grid(x=rs.Axis(-0.5, 0.5, 6), y=rs.Axis(-0.4, 0.4, 5), z=rs.Axis(0.2, 0.4, 3))
    quantities = [rs.Quantity.WORST_DEFLECTION, rs.Quantity.PRINCIPAL_STIFFNESS]
    return rs.stiffness_map(robot("3-puu"), grid, quantities)


@cache
def held_across_x() -> rs.RobotStiffness:
    """A platform on five springs that slides along x."""
    slide = rs.prismatic((1, 0, 0), rs.Passive())
    springs = [
        rs.prismatic((0, 1, 0), rs.Actuated(2e6), name="y"),
        rs.prismatic((0, 0, 1), rs.Actuated(3e6), name="z"),
        rs.revolute((1, 0, 0), rs.Actuated(1e4), name="a"),
        rs.revolute((0, 1, 0), rs.Actuated(1e4), name="b"),
        rs.revolute((0, 0, 1), rs.Actuated(1e4), name="c"),
    ]
    leg = rs.Leg("arm", HERE, rs.Chain((slide, *springs)), HERE)
    return rs.stiffness(rs.Robot("held", (leg,)))
