"""Paths with process forces as CSV files, and the same files with commands."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.maps.pose_columns import POSE_UNITS, coordinate_units
from robostiff.compensation.compensate import Compensation
from robostiff.elastostatics import Status
from robostiff.errors import FileError, InputError, Location
from robostiff.io.units import Dimension, parse_quantity, to_si
from robostiff.io.whole_file import bounded_bytes, whole_file
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.pose import home_coordinates
from robostiff.model import Robot

_MOST_BYTES = 500_000_000
_LARGEST = 1e30
_HEADING = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*\Z")
_DIMENSIONS = {
    "m": Dimension.LENGTH,
    "rad": Dimension.ANGLE,
    "N": Dimension.FORCE,
    "N m": Dimension.MOMENT,
}
_EULER = re.compile(r"(?:[xyz]{3}|[XYZ]{3})\Z")


@dataclass(frozen=True)
class _Heading:
    """A column that is read."""

    name: str
    place: int  # among the columns of the file
    unit: str
    factor: float  # SI units in its unit


@dataclass(frozen=True)
class ProgramFile:
    """A path as a file has it.

    Attributes
    ----------
    robot : Robot
    lines : tuple of str
        All lines of the file.
    header : int
        Number of the line of headings, from 0.
    rows : tuple of int
        Numbers of the lines of points.
    separator : str
        A tab, a semicolon, behind which decimals may have commas, or a comma.
    columns : tuple of _Heading
        Coordinates, then the wrench.
    angles : str or None
        Order of the Euler angles rx, ry, rz: ``xyz`` about axes that stay, ``XYZ`` about axes that
        move along; None for a rotation vector.
    poses : (N, 6) array or JointCoordinates
    wrenches : (N, r) array
        [N, N m].
    """

    robot: Robot
    lines: tuple[str, ...]
    header: int
    rows: tuple[int, ...]
    separator: str
    columns: tuple[_Heading, ...]
    angles: str | None
    poses: np.ndarray | JointCoordinates
    wrenches: np.ndarray

    def with_commands(self, found: Compensation) -> list[str]:
        """The lines with commands behind: what was in the file stays as it was.

        Columns ``_cmd`` are in the units of the columns that they replace; drives and coordinates
        that the file does not have are in SI units, what is left in micrometres and microradians.
        Points without an answer have none.
        """
        if isinstance(self.poses, JointCoordinates):
            commands = {name: found.coordinates[:, k] for k, name in enumerate(self._joint_names)}
        else:
            commands = dict(zip(POSE_UNITS, self._written_rotation(found.commanded).T, strict=True))
        written = {column.name: column for column in self.columns}
        headings, values = [], []
        for name, own in commands.items():
            column = written.get(name)
            if column is None and name not in self._corrected:
                continue
            unit, factor = (self._si[name], 1.0) if column is None else (column.unit, column.factor)
            headings.append(f"{name}_cmd [{unit}]")
            values.append(own / factor)
        for k, name in enumerate(found.drive_names):
            headings.append(f"{name} [{self._drive_units[k]}]")
            values.append(found.drives[:, k])
        headings += ["residual [um]", "residual turn [urad]"]
        values += [1e6 * np.linalg.norm(found.left[:, p], axis=1) for p in (slice(3), slice(3, 6))]
        mark = self.separator
        comma = mark == ";" and any("," in self.lines[k] for k in self.rows)
        lines = list(self.lines)
        lines[self.header] += mark + mark.join([*headings, "status"])
        table = np.array(values).T.tolist()
        for k, line in enumerate(self.rows):
            fields = [f"{value:.12g}" if math.isfinite(value) else "" for value in table[k]]
            if comma:
                fields = [field.replace(".", ",") for field in fields]
            lines[line] += mark + mark.join([*fields, str(Status(int(found.status_codes[k])))])
        return lines

    @property
    def _corrected(self) -> set[str]:
        """Names of the coordinates that have commands: free ones, or all joints."""
        if isinstance(self.poses, JointCoordinates):
            return set(self._joint_names)
        return {coordinate.value for coordinate in self.robot.coordinates} or set(POSE_UNITS)

    @property
    def _si(self) -> dict[str, str]:
        return {**POSE_UNITS, **coordinate_units(self.robot)}

    @property
    def _joint_names(self) -> tuple[str, ...]:
        return self.robot.legs[0].chain.coordinate_names

    @property
    def _drive_units(self) -> list[str]:
        """SI units of the drives."""
        from robostiff.kinematics.machine_pose import actuator_places

        places = actuator_places(self.robot)
        freedoms = [leg.chain.freedoms for leg in self.robot.legs]
        return [
            freedom[place].unit
            for freedom, own in zip(freedoms, places, strict=True)
            for place in own.tolist()
        ]

    def _written_rotation(self, poses: np.ndarray) -> np.ndarray:
        """Poses (N, 6) with Euler angles in place of the rotation vector, if the file has them."""
        if self.angles is None:
            return poses
        from scipy.spatial.transform import Rotation

        found, known = poses.copy(), np.isfinite(poses).all(axis=1)
        turned = Rotation.from_rotvec(poses[known, 3:]).as_euler(self.angles)
        found[np.ix_(known, _places(self.angles))] = turned
        return found


def _places(angles: str) -> list[int]:
    """Columns of a pose that have the angles, in their order."""
    return [3 + "xyz".index(axis) for axis in angles.lower()]


def read_program(
    robot: Robot, path: str | os.PathLike[str], *, angles: str | None = None
) -> ProgramFile:
    r"""A path with process forces from a CSV file, a point a line.

    The first line has the names of the columns, with units in brackets: pose coordinates
    ``x [mm]`` to ``rz [deg]`` or joints of an arm, and the wrench ``Fx [N]`` to ``Mz [N m]``.
    Coordinates that are left out stay at home, parts of the wrench at zero. Other columns, empty
    lines and lines that begin with ``#`` are passed over. Tabs, semicolons or commas separate;
    with semicolons decimals may have commas.

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
    ...         _ = file.write("N, x [mm], z [mm], Fz [N]\n10, 50, 900, -200\n")
    ...     program = read_program(rs.load("hexapod"), path)
    >>> program.poses.tolist(), program.wrenches.tolist()
    ([[0.05, 0.0, 0.9, 0.0, 0.0, 0.0]], [[0.0, 0.0, -200.0, 0.0, 0.0, 0.0]])
    """
    if angles is not None and not (_EULER.match(angles) and len(set(angles)) == 3):
        raise InputError(
            "order of angles", got=angles, expected="x, y and z in some order, as zyx or ZYX"
        )
    name = str(path)
    content = bounded_bytes(path, _MOST_BYTES, "a CSV file")
    try:
        lines = tuple(content.decode("utf-8-sig").splitlines())
    except UnicodeDecodeError as error:
        raise FileError(Location(name), "text", got="other bytes", expected="UTF-8") from error
    numbered = [k for k, line in enumerate(lines) if line.strip() and line.lstrip()[0] != "#"]
    if len(numbered) < 2:
        raise FileError(
            Location(name), "points", got="none", expected="a line of headings, then a line a point"
        )
    header, rows = numbered[0], tuple(numbered[1:])
    separator = next((mark for mark in "\t;," if mark in lines[header]), ",")
    fields = lines[header].split(separator)
    columns = _columns(robot, name, header + 1, fields, separator)
    table = np.empty((len(rows), len(columns)))
    for k, row in enumerate(rows):
        table[k] = _values(name, row + 1, lines[row], separator, len(fields), columns)
    si = {c.name: table[:, k] * c.factor for k, c in enumerate(columns)}
    return ProgramFile(
        robot=robot,
        lines=lines,
        header=header,
        rows=rows,
        separator=separator,
        columns=columns,
        angles=angles,
        poses=_poses(robot, si, len(rows), angles, Location(name, header + 1, 1)),
        wrenches=np.array(
            [si.get(each, np.zeros(len(rows))) for each in robot.space.wrench_order]
        ).T,
    )


def _columns(
    robot: Robot, file: str, line: int, fields: Sequence[str], separator: str
) -> tuple[_Heading, ...]:
    """Headings that are read; others are passed over."""
    known = dict(POSE_UNITS) | coordinate_units(robot)
    forces = dict(zip(robot.space.wrench_order, robot.space.wrench_units, strict=True))
    units = known | forces
    found: dict[str, _Heading] = {}
    start = 0
    for place, heading in enumerate(fields):
        at = Location(file, line, start + 1 + len(heading) - len(heading.lstrip()))
        start += len(heading) + len(separator)
        match = _HEADING.match(heading)
        if not match or match["name"] not in units:
            continue
        name, unit = match["name"], (match["unit"] or "").strip()
        if name in found:
            raise FileError(at, "heading", got=name, expected="each name once")
        if not unit:
            raise FileError(
                at,
                f"unit of {name}",
                got="none",
                expected=f"one in brackets, as {name} [{units[name]}]",
            )
        try:
            factor = to_si(
                parse_quantity(f"1 {unit}"),
                _DIMENSIONS[units[name]],
                subject=f"unit of {name}",
                got=unit,
            )
        except InputError as error:
            raise FileError.from_input_error(at, error) from None
        found[name] = _Heading(name, place, unit, factor)
    if not set(found) & set(known):
        raise FileError(
            Location(file, line, 1),
            "headings",
            got=", ".join(field.strip() for field in fields),
            expected=f"some of {', '.join(known)}, with units",
        )
    return tuple(found.values())


def _values(
    file: str, line: int, text: str, separator: str, count: int, columns: Sequence[_Heading]
) -> list[float]:
    """Numbers of a line in the columns that are read."""
    fields = text.split(separator)
    if len(fields) != count:
        raise FileError(
            Location(file, line, 1),
            "point",
            got=f"{len(fields)} fields",
            expected=f"{count}, one for each heading",
        )
    found = []
    for column in columns:
        field = fields[column.place]
        written = field.strip()
        try:
            value = float(written.replace(",", ".") if separator == ";" else written)
        except ValueError:
            value = math.nan
        if not abs(value) <= _LARGEST:
            before = sum(len(each) + len(separator) for each in fields[: column.place])
            raise FileError(
                Location(file, line, before + 1 + len(field) - len(field.lstrip()), column.name),
                "value",
                got=written or "nothing",
                expected="a finite number up to 1e30; units belong in the heading",
            )
        found.append(value)
    return found


def _poses(
    robot: Robot, si: dict[str, np.ndarray], count: int, angles: str | None, place: Location
) -> np.ndarray | JointCoordinates:
    """Poses (N, 6), or joints, by the values of columns."""
    joints = coordinate_units(robot)
    given = [name for name in joints if name in si]
    if given and any(name in si for name in POSE_UNITS):
        raise FileError(
            place, "headings", got="joints and pose coordinates", expected="one kind of them"
        )
    if given:
        home = robot.numeric.legs[0].chain.home
        each = [
            si.get(name, np.full(count, float(q))) for name, q in zip(joints, home, strict=True)
        ]
        return JointCoordinates(np.array(each).T)
    home = home_coordinates(robot.numeric)
    poses = np.array([si.get(name, np.full(count, home[k])) for k, name in enumerate(POSE_UNITS)]).T
    if angles is not None:
        from scipy.spatial.transform import Rotation

        turned = poses[:, _places(angles)]
        poses[:, 3:] = Rotation.from_euler(angles, turned).as_rotvec()
    return poses


def write_program(program: ProgramFile, found: Compensation, path: str | os.PathLike[str]) -> None:
    """Write a path with its commands, whole or not at all; see `ProgramFile.with_commands`."""
    with whole_file(path) as begun, begun.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in program.with_commands(found))
