"""Poses from CSV files."""

from __future__ import annotations

import math
import os
import re
from array import array
from pathlib import Path
from typing import NamedTuple

import numpy as np

from robostiff.analysis.maps import PoseList
from robostiff.analysis.maps.pose_columns import SIX, Mapped, coordinate_units
from robostiff.errors import FileError, InputError, Location
from robostiff.io.units import Dimension, parse_quantity, to_si
from robostiff.model import Snapshot

_HEADING = re.compile(r"\s*(?P<name>[^\[\(]+?)\s*(?:[\[\(](?P<unit>[^\]\)]*)[\]\)])?\s*\Z")
_LARGEST = 1e30
_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0}


def read_poses(robot: Mapped | Snapshot, path: str | os.PathLike[str]) -> PoseList:
    r"""Poses of a robot from a CSV file, one a line.

    The first line names the columns, with units in brackets or SI: ``x [mm], y [mm], rz [deg]``.
    Columns are pose coordinates ``x y z rx ry rz`` or joints of a serial arm; a column ``time`` [s]
    or ``s`` (length along the path [m]) runs along a trajectory. Commas, semicolons or tabs
    separate; empty lines and lines that begin with ``#`` are passed over.

    Parameters
    ----------
    robot : Robot, Linkage or CableRobot
        The robot, which determines names and units of coordinates.
    path : path

    Returns
    -------
    PoseList

    Raises
    ------
    FileError
        With line and column of what cannot be read.

    Examples
    --------
    >>> import robostiff as rs, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/poses.csv"
    ...     with open(path, "w") as file:
    ...         _ = file.write("time, x [mm], rz [deg]\n0, 10, 0\n0.5, 20, 90\n")
    ...     read_poses(rs.load("hexapod"), path)
    <PoseList of 2 poses: x rz>
    """
    if not isinstance(robot, Mapped):
        expected = "a Robot, a Linkage or a CableRobot, which has poses"
        raise InputError("robot of poses", got=robot, expected=expected)
    name = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError("file of poses", got=name, expected=f"a CSV file ({why})") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 2:
        raise FileError(
            Location(name), "poses", got="no pose", expected="a line of names, then a line a pose"
        )
    number, header = lines[0]
    separator = next((mark for mark in "\t;," if mark in header), ",")
    columns = _pose_columns(robot, name, number, header, separator)
    values = array("d")
    for number, line in lines[1:]:
        fields = line.split(separator)
        if len(fields) != len(columns):
            raise FileError(
                Location(name, number, 1),
                "pose",
                got=f"{len(fields)} fields",
                expected=f"{len(columns)}, one for each name in line {lines[0][0]}",
            )
        row = [_number(field) for field in fields]
        if not all(abs(value) <= _LARGEST for value in row):
            raise _bad_field(name, number, fields, columns)
        values.extend(row)
    return _pose_list(name, columns, np.array(values).reshape(-1, len(columns)))


class _Column(NamedTuple):
    """A column of the file."""

    name: str
    factor: float  # SI units in its unit
    place: Location  # of its heading


def _pose_columns(
    robot: Mapped, file: str, number: int, header: str, separator: str
) -> list[_Column]:
    columns: list[_Column] = []
    units = {**dict(zip(SIX, "mmmrrr", strict=True)), **coordinate_units(robot)}
    dimensions = {
        name: Dimension.LENGTH if unit == "m" else Dimension.ANGLE for name, unit in units.items()
    }
    start = 0
    for heading in header.split(separator):
        place = Location(file, number, start + 1 + len(heading) - len(heading.lstrip()))
        start += len(heading) + 1
        found = _HEADING.match(heading.strip().removeprefix("'"))  # written before = + - @
        known = ", ".join([*dimensions, "time", "s"])
        if not found or found["name"] not in {*dimensions, "time", "s"}:
            raise FileError(
                place, "name of a column", got=heading.strip(), expected=f"one of {known}"
            )
        name, unit = found["name"], (found["unit"] or "").strip()
        if name in [column.name for column in columns]:
            raise FileError(place, "name of a column", got=name, expected="each name once")
        columns.append(_Column(name, _factor(place, name, unit, dimensions), place))
    return columns


def _factor(place: Location, name: str, unit: str, dimensions: dict[str, Dimension]) -> float:
    if name == "time":
        if unit not in _SECONDS:
            raise FileError(place, "unit of time", got=unit, expected="s, ms or min")
        return _SECONDS[unit]
    try:
        return to_si(
            parse_quantity(f"1 {unit}"),
            dimensions.get(name, Dimension.LENGTH),
            subject=f"unit of {name}",
            got=unit,
        )
    except InputError as error:
        raise FileError.from_input_error(place, error) from None


def _bad_field(file: str, number: int, fields: list[str], columns: list[_Column]) -> FileError:
    bad = next(k for k, field in enumerate(fields) if not abs(_number(field)) <= _LARGEST)
    field = fields[bad]
    start = sum(len(before) + 1 for before in fields[:bad]) + len(field) - len(field.lstrip())
    return FileError(
        Location(file, number, start + 1, columns[bad].name),
        "value",
        got=field.strip() or "nothing",
        expected="a finite number up to 1e30, with a point; units belong in the heading",
    )


def _number(field: str) -> float:
    try:
        return float(field)
    except ValueError:
        return math.nan


def _pose_list(file: str, columns: list[_Column], rows: np.ndarray) -> PoseList:
    si = {column.name: column.factor * rows[:, k] for k, column in enumerate(columns)}
    time, path_length = si.pop("time", None), si.pop("s", None)
    if time is not None and path_length is not None:
        raise FileError(columns[0].place, "columns time and s", expected="one of them")
    if not si:
        raise FileError(
            columns[0].place, "columns", got="no coordinate", expected="at least one, such as x"
        )
    return PoseList(
        list(si), np.stack(list(si.values()), axis=-1), time=time, path_length=path_length
    )
