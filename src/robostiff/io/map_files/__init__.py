"""Files of maps: poses from CSV, maps as CSV and NetCDF."""

from __future__ import annotations

import math
import os
import re
from array import array
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.maps import PoseList
from robostiff.analysis.maps.pose_columns import SIX, coordinate_units
from robostiff.analysis.maps.variables import status_words
from robostiff.errors import FileError, InputError, Location, printable
from robostiff.io.map_files.netcdf import check_netcdf, write_map_netcdf
from robostiff.io.units import Dimension, parse_quantity, to_si
from robostiff.io.whole_file import whole_file
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot

if TYPE_CHECKING:
    import xarray

__all__ = ["check_netcdf", "map_csv_lines", "read_poses", "write_map_csv", "write_map_netcdf"]

_ROWS = 50_000
_UNITS_OF_K = {("F", "d"): "N/m", ("F", "r"): "N/rad", ("M", "d"): "N m/m", ("M", "r"): "N m/rad"}


def write_map_csv(found: xarray.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a map as CSV, whole or not at all; see `map_csv_lines`.

    Parameters
    ----------
    found : xarray.Dataset
        From `stiffness_map`.
    path : path
        Overwritten.

    Raises
    ------
    OSError
    """
    with whole_file(path) as begun, begun.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in map_csv_lines(found))


def map_csv_lines(found: xarray.Dataset) -> Iterator[str]:
    """A map as lines of CSV: headings with units, then a line a pose.

    Coordinates, quantities, rank, and the status in words. A field is empty where there is no
    answer. All digits are written.

    Examples
    --------
    >>> import robostiff as rs
    >>> found = rs.stiffness_map(rs.load("3-puu"), rs.Grid(x=rs.Axis(0, 5, 2)), [])
    >>> list(map_csv_lines(found))
    ['x [m],rank,status', '0.0,6,ok', '5.0,-1,unreachable']
    """
    dims = found["status"].dims
    shape = tuple(found.sizes[dim] for dim in dims)
    columns = list(_columns(found, dims))
    yield ",".join(heading for heading, _, _ in columns)
    count = int(np.prod(shape))
    for start in range(0, count, _ROWS):
        rows = np.arange(start, min(start + _ROWS, count))
        place = dict(zip(dims, np.unravel_index(rows, shape), strict=True))
        texts = [
            _texts(heading, values[tuple(place[dim] for dim in own)])
            for heading, own, values in columns
        ]
        yield from (",".join(row) for row in zip(*texts, strict=True))


def _columns(
    found: xarray.Dataset, dims: tuple[Hashable, ...]
) -> Iterator[tuple[str, tuple[Hashable, ...], np.ndarray]]:
    """Heading, dimensions of the poses and values of each column."""
    for name in [*found.coords, *found.data_vars]:
        array = found[name]
        along = tuple(dim for dim in array.dims if dim in dims)
        if not along:
            continue  # names of rows and columns go into the headings
        values = array.values
        own = tuple(dim for dim in array.dims if dim not in dims)
        labels = [
            [str(v) for v in found[dim].values]
            if dim in found.coords
            else [str(k + 1) for k in range(found.sizes[dim])]
            for dim in own
        ]
        for index in np.ndindex(*(len(words) for words in labels)):
            words = [labels[k][i] for k, i in enumerate(index)]
            unit = array.attrs.get("units", "1")
            if len(words) == 2:
                unit = _UNITS_OF_K[words[0][0], words[1][0]]
            heading = "_".join([str(name), *words])
            heading += "" if unit == "1" else f" [{unit}]"
            yield _field(heading), along, values[(..., *index)]


def _field(heading: str) -> str:
    """A heading as a single field that spreadsheets do not interpret as a formula.

    Examples
    --------
    >>> _field("=1+1 [m]"), _field('the "slide", long')
    ("'=1+1 [m]", '"the ""slide""; long"')
    """
    shown = printable(heading).replace(",", ";")
    if heading[:1] in tuple("=+-@\t\r"):
        shown = f"'{shown}"
    return '"' + shown.replace('"', '""') + '"' if '"' in shown else shown


def _texts(heading: str, values: np.ndarray) -> list[str]:
    if heading == "status":
        words = {int(code): status_words(int(code)) for code in np.unique(values)}
        return [words[code] for code in values.tolist()]
    if values.dtype.kind != "f":
        return [str(value) for value in values.tolist()]
    # As few digits as reproduce the number exactly; nine suffice for single precision.
    written = repr if values.dtype.itemsize == 8 else "{:.9g}".format
    return ["" if math.isnan(value) else written(value) for value in values.tolist()]


_HEADING = re.compile(r"\s*(?P<name>[^\[\(]+?)\s*(?:[\[\(](?P<unit>[^\]\)]*)[\]\)])?\s*\Z")
_LARGEST = 1e30
_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0}


def read_poses(robot: Robot | Linkage | Snapshot, path: str | os.PathLike[str]) -> PoseList:
    r"""Poses of a robot from a CSV file, one a line.

    The first line names the columns, with units in brackets or SI: ``x [mm], y [mm], rz [deg]``.
    Columns are pose coordinates ``x y z rx ry rz`` or joints of a serial arm; a column ``time`` [s]
    or ``s`` (length along the path [m]) runs along a trajectory. Commas, semicolons or tabs
    separate; empty lines and lines that begin with ``#`` are passed over.

    Parameters
    ----------
    robot : Robot or Linkage
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
    if not isinstance(robot, Robot | Linkage):
        expected = "a Robot or a Linkage, which has poses"
        raise InputError("robot of poses", got=robot, expected=expected)
    name = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("file of poses", got=name, expected=f"a CSV file ({error})") from None
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
        try:
            row = [float(field) for field in fields]
        except ValueError:
            row = [math.nan]
        if not all(abs(value) <= _LARGEST for value in row):
            raise _bad_field(name, number, fields, columns)
        values.extend(row)
    return _pose_list(name, columns, np.array(values).reshape(-1, len(columns)))


class _Column:
    """A column of the file: its name, its number of SI units, its heading's place."""

    def __init__(self, name: str, factor: float, place: Location) -> None:
        self.name, self.factor, self.place = name, factor, place


def _pose_columns(
    robot: Robot | Linkage, file: str, number: int, header: str, separator: str
) -> list[_Column]:
    columns: list[_Column] = []
    dimensions = _dimensions(robot)
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


def _dimensions(robot: Robot | Linkage) -> dict[str, Dimension]:
    """Dimension of each column of poses."""
    found = {name: Dimension.LENGTH if k < 3 else Dimension.ANGLE for k, name in enumerate(SIX)}
    for name, unit in coordinate_units(robot).items():
        found[name] = Dimension.LENGTH if unit == "m" else Dimension.ANGLE
    return found


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
    bad = next(k for k, field in enumerate(fields) if not _is_number(field))
    field = fields[bad]
    start = sum(len(before) + 1 for before in fields[:bad]) + len(field) - len(field.lstrip())
    return FileError(
        Location(file, number, start + 1, columns[bad].name),
        "value",
        got=field.strip() or "nothing",
        expected="a finite number up to 1e30, with a point; units belong in the heading",
    )


def _is_number(field: str) -> bool:
    try:
        return abs(float(field)) <= _LARGEST
    except ValueError:
        return False


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
