"""Postures in the columns of a file: joints of an arm, or pose coordinates of a platform."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.errors import FileError, Location
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import Robot


def posture_columns(
    robot: Robot, given: Collection[str], at: Location, heading: str, prefix: str = ""
) -> list[str]:
    """Names of all coordinates of the kind that a file has, joints or, behind a prefix, a pose.

    Raises FileError at a heading that has none of them, or both kinds.
    """
    joints = coordinate_units(robot)
    poses = [f"{prefix}{name}" for name in POSE_UNITS]
    kinds = [own for own in ([*joints], poses) if set(own) & set(given)]
    if not kinds:
        expected = f"some of {', '.join([*joints, *poses])}, with units"
        raise FileError(at, "names of columns", got=heading, expected=expected)
    if len(kinds) > 1:
        raise FileError(at, "postures", got="joints and poses", expected="one kind of them")
    return kinds[0]


def postures_of(
    robot: Robot, names: list[str], si: Mapping[str, np.ndarray], count: int
) -> np.ndarray | JointCoordinates:
    """Joints (N, n) or poses (N, 6) by `posture_columns`; what is left out stays at home."""
    by_joints = names[0] in coordinate_units(robot)
    own = robot.numeric
    home = own.legs[0].chain.home if by_joints else home_coordinates(own)
    each = [si.get(name, np.full(count, float(q))) for name, q in zip(names, home, strict=True)]
    found = np.array(each).T
    return JointCoordinates(found) if by_joints else found
