"""Columns of poses: free coordinates, all six, or the joints of a serial arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Pose
from robostiff.kinematics.pose import home_coordinates, joint_units
from robostiff.model import ALL_COORDINATES, Leg, Robot
from robostiff.spatial import Space

SIX = tuple(coordinate.value for coordinate in ALL_COORDINATES)
_UNITS = Space.SPATIAL.twist_units


@dataclass(frozen=True)
class PoseColumns:
    """Names, units and home values of the coordinates of a pose.

    Attributes
    ----------
    names : tuple of str
    units : tuple of str
        ``m`` or ``rad``.
    home : tuple of float
        Values of those that are not asked for.
    of_joints : bool
        Whether they are joint coordinates of a serial arm.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    home: tuple[float, ...]
    of_joints: bool

    def as_pose(self, poses: np.ndarray) -> Pose:
        """Poses (N, n) as `stiffness` takes them."""
        return JointCoordinates(poses) if self.of_joints else poses

    def unit_of(self, name: str) -> str:
        """Unit of one of them."""
        return self.units[self.names.index(name)]


def pose_columns(robot: Robot, used: Sequence[str]) -> PoseColumns:
    """The columns of poses given by the coordinates `used`; the others stay at home.

    Free coordinates of the robot alone leave the rest to its legs; any other pose coordinate makes
    it all six; names of joints pose a serial arm.

    Raises
    ------
    InputError
        When a name is no coordinate of the robot.

    Examples
    --------
    >>> import robostiff as rs
    >>> pose_columns(rs.load("3-puu"), ["x"]).names
    ('x', 'y', 'z')
    >>> pose_columns(rs.load("two-link-arm"), ["elbow"]).names
    ('shoulder', 'elbow')
    """
    free = tuple(coordinate.value for coordinate in robot.coordinates)
    six = SIX if robot.space is Space.SPATIAL else tuple(SIX[k] for k in robot.space.rows)
    joints = joint_columns(robot.legs[0]) if robot.is_serial else None
    wanted = set(used)
    if wanted and wanted <= set(free):
        return _of_platform(robot, free)
    if wanted and wanted <= set(six):
        return _of_platform(robot, SIX)
    if joints is not None and wanted and wanted <= set(joints.names):
        return joints
    allowed = six if joints is None else (*six, *joints.names)
    strange = [name for name in used if name not in allowed]
    if strange:
        expected = f"some of {', '.join(six)}"
        if joints is not None:
            expected += f"; or some of the joints {', '.join(joints.names)}"
        raise InputError(f"coordinate of {robot.name!r}", got=strange[0], expected=expected)
    raise InputError(
        f"coordinates of {robot.name!r}",
        got=", ".join(used) or "none",
        expected="pose coordinates or joints, not both" if used else "at least one",
    )


def joint_columns(leg: Leg) -> PoseColumns:
    """Joint coordinates of a leg, from base to platform."""
    chain = leg.chain
    units = joint_units(chain)
    return PoseColumns(chain.coordinate_names, units, tuple(map(float, chain.home)), of_joints=True)


def _of_platform(robot: Robot, names: tuple[str, ...]) -> PoseColumns:
    places = [SIX.index(name) for name in names]
    home = home_coordinates(robot)
    return PoseColumns(
        names,
        tuple(_UNITS[k] for k in places),
        tuple(float(home[k]) for k in places),
        of_joints=False,
    )
