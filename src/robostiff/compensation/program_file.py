"""Paths with process forces as CSV files, and the same files with commands."""

from __future__ import annotations

import math
import os
import re

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.compensation.compensate import Compensation
from robostiff.elastostatics import Status
from robostiff.errors import InputError, Location
from robostiff.frozen import frozen
from robostiff.io.csv_table import (
    CsvTable,
    OtherColumns,
    euler_places,
    posture_columns,
    postures_of,
    read_table,
)
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.machine_pose import actuator_places
from robostiff.kinematics.pose import joint_units
from robostiff.model import Robot
from robostiff.whole_file import whole_file

_EULER = re.compile(r"(?:[xyz]{3}|[XYZ]{3})\Z")


@frozen
class ProgramFile:
    """A path as a file has it."""

    robot: Robot
    table: CsvTable
    #: order of the Euler angles rx, ry, rz: ``xyz`` about axes that stay, ``XYZ`` about axes that
    #: move along; None for a rotation vector
    angles: str | None
    poses: np.ndarray | JointCoordinates  #: (N, n): free coordinates [m, rad], or joints
    wrenches: np.ndarray  #: (N, r) [N, N m]

    def with_commands(self, found: Compensation) -> list[str]:
        """The lines with commands behind: what was in the file stays as it was.

        Columns ``_cmd`` are in the units of the columns that they replace; drives, where poses are
        commanded, and coordinates that the file does not have are in SI units, what is left in
        micrometres and microradians. Points without an answer have none.
        """
        by_joints = isinstance(self.poses, JointCoordinates)
        if by_joints:
            names = self.robot.legs[0].chain.coordinate_names
            commands = {name: found.coordinates[:, k] for k, name in enumerate(names)}
        else:
            names = {coordinate.value for coordinate in self.robot.coordinates} or set(POSE_UNITS)
            commands = dict(zip(POSE_UNITS, self._written_rotation(found.commanded).T, strict=True))
        si = {**POSE_UNITS, **coordinate_units(self.robot)}
        each = zip(self.robot.legs, actuator_places(self.robot), strict=True)
        units = [joint_units(leg.chain)[place] for leg, places in each for place in places.tolist()]
        written = {column.name: column for column in self.table.columns}
        headings, values = [], []
        for name, column_values in commands.items():
            column = written.get(name)
            if column is None and name not in names:
                continue
            unit, factor = (si[name], 1.0) if column is None else (column.unit, column.factor)
            headings.append(f"{name}_cmd [{unit}]")
            values.append(column_values / factor)
        drives = zip(found.drive_names, units, found.drives.T, strict=True)
        for name, unit, column_values in () if by_joints else drives:  # joints are drives
            headings.append(f"{name} [{unit}]")
            values.append(column_values)
        headings += ["residual [um]", "residual turn [urad]"]
        values += [
            1e6 * np.linalg.norm(found.residual[:, p], axis=1) for p in (slice(3), slice(3, 6))
        ]
        mark, rows, lines = self.table.separator, self.table.rows, list(self.table.lines)
        comma = mark == ";" and any("," in lines[k] for k in rows)
        lines[self.table.header] += mark + mark.join([*headings, "status"])
        for k, (line, row) in enumerate(zip(rows, np.array(values).T.tolist(), strict=True)):
            finite = [round(x, 12) + 0.0 if math.isfinite(x) else None for x in row]
            # Controls read no exponents.
            fields = ["" if x is None else np.format_float_positional(x, trim="-") for x in finite]
            if comma:
                fields = [field.replace(".", ",") for field in fields]
            lines[line] += mark + mark.join([*fields, str(Status(int(found.status_codes[k])))])
        return lines

    def _written_rotation(self, poses: np.ndarray) -> np.ndarray:
        """Poses (N, 6) with Euler angles in place of the rotation vector, if the file has them."""
        if self.angles is None:
            return poses
        from scipy.spatial.transform import Rotation

        found, known = poses.copy(), np.isfinite(poses).all(axis=1)
        turned = Rotation.from_rotvec(poses[known, 3:]).as_euler(self.angles)
        for place, angle in zip(euler_places(self.angles), turned.T, strict=True):
            found[known, place] = angle
        return found


def read_program(
    robot: Robot, path: str | os.PathLike[str], *, angles: str | None = None
) -> ProgramFile:
    r"""A path with process forces from a CSV file, a point a line.

    The first line has the names of the columns, with units in brackets: pose coordinates
    ``x [mm]`` to ``rz [deg]`` or joints of an arm, and the wrench ``Fx [N]`` to ``Mz [N m]``.
    Pose coordinates that are left out stay at home, parts of the wrench at zero; of joints there
    are all. Other columns stay in the file; those with units with a warning that they are not read,
    as are coordinates that the legs decide. Empty lines and lines that begin with ``#`` are passed
    over. Tabs, semicolons or commas separate; with semicolons decimals may have commas.

    Parameters
    ----------
    robot : Robot
    path : path
    angles : str, optional
        Order of Euler angles in rx, ry, rz, as ``zyx`` or ``ZYX``; a rotation vector when left out.

    Raises
    ------
    FileError
        With line and column of what cannot be read.

    Examples
    --------
    >>> import robostiff as rs, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/path.csv"
    ...     with open(path, "w") as file:
    ...         _ = file.write("x [mm], z [mm], Fz [N]\n50, 900, -200\n")
    ...     program = read_program(rs.load("hexapod"), path)
    >>> program.poses.tolist(), program.wrenches.tolist()
    ([[0.05, 0.0, 0.9, 0.0, 0.0, 0.0]], [[0.0, 0.0, -200.0, 0.0, 0.0, 0.0]])
    """
    if angles is not None and not (_EULER.match(angles) and len(set(angles)) == 3):
        raise InputError(
            "order of angles", got=angles, expected="x, y and z in some order, as zyx or ZYX"
        )
    coordinates = POSE_UNITS | coordinate_units(robot)
    forces = dict(zip(robot.space.wrench_order, robot.space.wrench_units, strict=True))
    table = read_table(path, coordinates | forces, "point", others=OtherColumns.KEPT)
    place, count = Location(str(path), table.header + 1, 1), len(table.rows)
    names = posture_columns(robot, table, place, angles=angles)
    poses = postures_of(robot, names, table.si, count, angles)
    wrenches = [table.si.get(name, np.zeros(count)) for name in forces]
    return ProgramFile(robot, table, angles, poses, np.array(wrenches).T)


def write_program(program: ProgramFile, found: Compensation, path: str | os.PathLike[str]) -> None:
    """Write a path with its commands, whole or not at all; see `ProgramFile.with_commands`."""
    with whole_file(path) as begun, begun.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in program.with_commands(found))
