"""Robots to compile, and poses around home."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import Pose
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import ALL_COORDINATES

BACKENDS = [
    rs.Backend.ARRAYS,
    pytest.param(rs.Backend.MACHINE, marks=pytest.mark.needs("llvmlite")),
]


def model(name: str, *symbols: str) -> rs.Robot:
    return rs.load(name, symbols=symbols) if symbols else rs.load(name)


def around_home(robot: rs.Robot, count: int, spread: float = 0.05, seed: int = 7) -> Pose:
    """Poses (count, n) by the robot's own coordinates, or by the joints of an arm."""
    random, twin = np.random.default_rng(seed), robot.numeric
    if robot.is_serial and robot.home is None:
        home = twin.legs[0].chain.home
        return rs.JointCoordinates(home + random.uniform(-spread, spread, (count, home.size)))
    chosen = [ALL_COORDINATES.index(coordinate) for coordinate in robot.coordinates]
    home = home_coordinates(twin)[chosen]
    return home + random.uniform(-spread, spread, (count, len(chosen)))


def row(pose: Pose, i: int) -> Pose:
    if isinstance(pose, rs.JointCoordinates):
        return rs.JointCoordinates(np.asarray(pose.values)[i])
    return np.asarray(pose)[i]


def every_output(wrench: Any) -> list[Any]:
    return [
        rs.StiffnessMatrix(),
        rs.ComplianceMatrix(),
        rs.DeflectionUnder(wrench),
        rs.PrincipalStiffness(),
        rs.WorstDeflection(),
    ]


def of_fourth_order(K: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Derivative of K(d) at 0 from values at -2h to 2h."""
    return (8 * (K(h) - K(-h)) - (K(2 * h) - K(-2 * h))) / (12 * h)
