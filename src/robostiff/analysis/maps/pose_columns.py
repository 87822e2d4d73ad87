"""Coordinates of poses, and what gives them: of a platform, a serial arm or a linkage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.pose import home_coordinates, joint_units
from robostiff.linkage import Linkage
from robostiff.linkage.driven import driven_by
from robostiff.model import ALL_COORDINATES, Joint, Leg, Robot
from robostiff.model.cable import CableRobot
from robostiff.spatial import Space, as_floats, holds_quantities

SIX = tuple(coordinate.value for coordinate in ALL_COORDINATES)
#: What has maps.
Mapped = Robot | Linkage | CableRobot
#: By which the wrench of a map under load is multiplied.
FACTOR = "factor"
#: SI unit of each pose coordinate.
POSE_UNITS: dict[str, str] = dict(zip(SIX, Space.SPATIAL.twist_units, strict=True))


def read_coordinate(
    subject: str, values: Any, expected: str, name: str = ""
) -> tuple[np.ndarray, str | None]:
    """Values of a coordinate in SI units, and their unit if they came with one.

    Of a joint lengths and angles are taken, and the robot decides.
    """
    if name in POSE_UNITS or not holds_quantities(values):
        return as_floats(subject, values, expected, POSE_UNITS.get(name)), None
    for unit in ("m", "rad"):
        try:
            return as_floats(subject, values, expected, unit), unit
        except InputError:
            continue
    raise InputError(subject, got=str(values), expected=f"{expected}: lengths or angles")


@frozen
class PoseColumns:
    """Names, units and home values of the coordinates of a pose."""

    names: tuple[str, ...]
    units: tuple[str, ...]  # ``m`` or ``rad``
    home: tuple[float, ...]  # values of those that are not asked for
    of_joints: bool  # whether they are joint coordinates of a serial arm or a linkage
    # Joints of a linkage that keep them, and how many each has
    drives: tuple[tuple[str, int], ...] = ()
    # How many of the last are no coordinates: the wrench and the factor of a map under load
    loads: int = 0

    def as_pose(self, poses: np.ndarray) -> Any:
        """Poses (N, n) as `stiffness` takes them."""
        poses = poses[..., : len(self.names) - self.loads]
        if self.drives:
            ends = np.cumsum([size for _, size in self.drives])[:-1]
            parts = np.split(poses, ends, axis=-1)
            return {
                name: part if size > 1 else part[:, 0]
                for (name, size), part in zip(self.drives, parts, strict=True)
            }
        return JointCoordinates(poses) if self.of_joints else poses

    def wrenches(self, poses: np.ndarray) -> np.ndarray:
        """Of a map under load the wrench at each pose times its factor (N, n) [N, N m]."""
        loads = poses[:, len(self.names) - self.loads :]
        return loads[:, :-1] * loads[:, -1:]

    def unit_of(self, name: str) -> str:
        """Unit of one of them."""
        return self.units[self.names.index(name)]


def pose_columns(
    robot: Mapped, used: Sequence[str], wrench: Sequence[float] | None = None
) -> PoseColumns:
    """The columns of poses given by the coordinates `used`; the others stay at home.

    Free coordinates of the robot alone leave the rest to its legs; any other pose coordinate makes
    it all six; names of joints pose a serial arm, or drive a linkage. An arm without a home of its
    platform has the joint of a name, whatever the platform calls so. With a wrench, perhaps empty,
    its components and a factor follow, as coordinates like the others.
    """
    if isinstance(robot, Linkage):
        connection_of = {name: c.name for c in robot.connections for name in c.coordinate_names}
        subject = f"coordinate of linkage {robot.name!r}"
        strange = [name for name in used if name not in connection_of]
        if strange or not used:
            expected = f"some of its joints: {', '.join(connection_of)}"
            raise InputError(subject, got=strange[0] if strange else "none", expected=expected)
        joints = tuple(dict.fromkeys(connection_of[name] for name in used))
        driven = driven_by(robot.in_floats, joints)
        if missing := [name for name in joints if name not in driven.drives]:
            expected = "joints between base and platform: this one changes nothing"
            raise InputError(subject, got=missing[0], expected=expected)
        sizes = tuple((name, driven.home.coordinates[name].size) for name in driven.drives)
        home = tuple(driven.at_home.tolist())
        return PoseColumns(driven.inputs, driven.units, home, of_joints=True, drives=sizes)
    loads = () if wrench is None else (*robot.space.wrench_order, FACTOR)
    names = [name for name in used if name not in loads]
    columns = _of_robot(robot, names, may_be_none=bool(used and loads))
    if wrench is None:
        return columns
    return replace(
        columns,
        names=(*columns.names, *loads),
        units=(*columns.units, *robot.space.wrench_units, "1"),
        home=(*columns.home, *(wrench or (0.0,) * robot.space.size), 1.0),
        loads=len(loads),
    )


def _of_robot(robot: Robot | CableRobot, used: Sequence[str], may_be_none: bool) -> PoseColumns:
    free = tuple(coordinate.value for coordinate in robot.coordinates)
    six = tuple(SIX[k] for k in robot.space.rows)
    by_joints = isinstance(robot, Robot) and robot.is_posed_by_joints
    joints = joint_columns(robot.legs[0]) if isinstance(robot, Robot) and robot.is_serial else None
    wanted, subject = set(used), f"coordinate of {robot.name!r}"
    if not used and may_be_none:
        return joints if by_joints and joints is not None else _of_platform(robot, free)
    if joints is not None and wanted and wanted <= set(joints.names):
        if not by_joints and (shared := wanted & set(six)):
            expected = "a name that a joint or the platform has alone"
            raise InputError(subject, got=min(shared), expected=expected, hint="rename the joint")
        return joints
    for names, coordinates in ((free, free), (six, SIX)):
        if wanted and wanted <= set(names):
            return _of_platform(robot, coordinates)
    allowed = six if joints is None else (*six, *joints.names)
    if strange := [name for name in used if name not in allowed]:
        expected = f"some of {', '.join(six)}"
        if joints is not None:
            expected += f"; or some of the joints {', '.join(joints.names)}"
        raise InputError(subject, got=strange[0], expected=expected)
    raise InputError(
        f"coordinates of {robot.name!r}",
        got=", ".join(used) or "none",
        expected="pose coordinates or joints, not both" if used else "at least one",
    )


def coordinate_units(robot: Mapped) -> dict[str, str]:
    """Units of the joint coordinates by which a robot can be posed; none of legs."""
    if isinstance(robot, Linkage):
        return {
            name: screw.unit
            for c in robot.connections
            if isinstance(c.element, Joint)
            for name, screw in zip(c.coordinate_names, c.element.freedoms, strict=True)
        }
    if isinstance(robot, CableRobot) or not robot.is_serial:
        return {}
    joints = joint_columns(robot.legs[0])
    return dict(zip(joints.names, joints.units, strict=True))


def joint_columns(leg: Leg) -> PoseColumns:
    """Joint coordinates of a leg, from base to platform."""
    names, home = leg.chain.coordinate_names, tuple(map(float, leg.chain.home))
    return PoseColumns(names, joint_units(leg.chain), home, of_joints=True)


def _of_platform(robot: Robot | CableRobot, names: tuple[str, ...]) -> PoseColumns:
    home = dict(zip(SIX, home_coordinates(cast(Any, robot)).tolist(), strict=True))
    units = tuple(POSE_UNITS[name] for name in names)
    return PoseColumns(names, units, tuple(home[name] for name in names), of_joints=False)
