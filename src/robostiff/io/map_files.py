"""Maps as CSV and NetCDF files, and read from any of their files; poses from CSV."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps import PoseList
from robostiff.analysis.maps.pose_columns import POSE_UNITS, Mapped, coordinate_units
from robostiff.analysis.maps.store import open_map
from robostiff.analysis.maps.stored import damaged
from robostiff.analysis.maps.variables import status_words
from robostiff.errors import FileError, InputError, Location, needs_extra, printable
from robostiff.io.child_process import READ_HDF5, ProcessLimits, answer_of
from robostiff.io.csv_table import read_table
from robostiff.io.whole_file import whole_file
from robostiff.model import Snapshot

if TYPE_CHECKING:
    import xarray


_FLAGS = ("flag_masks", "flag_values")
# After the end of HDF5, which other programs ignore: a checksum of everything before.
_SEAL = re.compile(rb"\nrobostiff map, sha256 of all before: ([0-9a-f]{64})\n\Z")
_SEAL_BYTES = len(b"\nrobostiff map, sha256 of all before: \n") + 64
_SECONDS, _BYTES_A_SECOND = 20, 5_000_000
_MOST_EXPANSION = 1100  # of deflate


def write_map_netcdf(found: xarray.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a map as NetCDF 4, whole or not at all.

    Every chunk has a checksum (fletcher32), and so has the whole file.

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
    check_netcdf()
    written = found.copy()
    written.attrs = {name: value for name, value in found.attrs.items() if value != ""}
    for variable in written.variables.values():
        # CF requires flags and ranges in the type of their variable.
        for name in (*_FLAGS, "actual_range"):
            if name in variable.attrs:
                variable.attrs = {
                    **variable.attrs,
                    name: np.array(variable.attrs[name], dtype=variable.dtype),
                }
    checked = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
    encoding = {
        name: checked if array.ndim and array.size else {}
        for name, array in written.data_vars.items()
    }
    # Made in memory, because HDF5 fails badly on a full disk.
    content = written.to_netcdf(engine="h5netcdf", encoding=encoding)
    seal = hashlib.sha256(content).hexdigest()
    with whole_file(path) as begun, begun.open("wb") as file:
        file.write(content)
        file.write(f"\nrobostiff map, sha256 of all before: {seal}\n".encode())


def read_map_netcdf(path: Path) -> xarray.Dataset:
    """All of a NetCDF file; first another process tries to read it, within limits."""
    check_netcdf()
    import xarray

    try:
        size = path.stat().st_size
        seal_holds = _seal_holds(path, size)
    except OSError as error:
        raise InputError(
            "map", got=str(path), expected=f"a NetCDF file ({error.strerror})"
        ) from None
    if seal_holds is False:
        raise damaged(path, "a content that does not agree with its checksum")
    _try_elsewhere(path, size)
    try:
        with xarray.open_dataset(path, engine="h5netcdf") as found:
            return found.load()
    except Exception as error:  # any failure of HDF5 or xarray at a file of another program
        raise damaged(
            path, f"contents that cannot be read ({type(error).__name__}: {error})"
        ) from None


def check_netcdf() -> None:
    """Raise when the packages for NetCDF are not installed; to be called before the computation."""
    with needs_extra("maps", "maps"):
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401


def _seal_holds(path: Path, size: int) -> bool | None:
    """Whether the checksum is right; None for a file of another program."""
    with path.open("rb") as file:
        if file.read(8) != b"\x89HDF\r\n\x1a\n":
            raise damaged(path, "a start that is not that of a NetCDF 4 file")
        file.seek(max(0, size - _SEAL_BYTES))
        seal = _SEAL.search(file.read())
        if seal is None:
            return None
        file.seek(0)
        checksum, rest = hashlib.sha256(), size - _SEAL_BYTES
        while rest > 0 and (part := file.read(min(rest, 2**20))):
            checksum.update(part)
            rest -= len(part)
        return checksum.hexdigest().encode() == seal[1]


def _try_elsewhere(path: Path, size: int) -> None:
    """Read all of a file in a process with limits on memory and time."""
    expanded = _MOST_EXPANSION * size
    limits = ProcessLimits(2**31 + expanded, _SECONDS + size // _BYTES_A_SECOND)
    request = {"path": str(path), "expanded": expanded}
    try:
        answer_of(READ_HDF5, request, Location(str(path)), "map", "HDF5", limits)
    except FileError as error:
        raise damaged(path, f"contents that HDF5 cannot read ({error.got})") from None


def read_map(path: str | Path) -> xarray.Dataset:
    """A map that was written to Zarr, read when its values are needed, or to NetCDF."""
    path = Path(path)
    try:
        is_there = path.exists()
    except (OSError, ValueError):
        is_there = False
    if not is_there:
        raise InputError("map", got=str(path), expected="a file or store that is there")
    if path.suffix == ".zarr":
        found = open_map(path)
    elif path.suffix == ".nc":
        found = read_map_netcdf(path)
    else:
        raise InputError(
            "map",
            got=path.name,
            expected="a store .zarr or a file .nc",
            hint="robostiff map ROBOT ... -o map.zarr writes one",
        )
    if why := _is_no_map(found):
        raise InputError(f"map {str(path)!r}: a dataset {why}, which is no map of robostiff")
    return found


def _is_no_map(found: xarray.Dataset) -> str | None:
    """The reason why a dataset is not a map of robostiff; None for a map."""
    if not {"status", "rank"} <= set(found.data_vars):
        return "without the variables status and rank"
    dims, attributes = found["status"].dims, found.attrs
    texts = [attributes.get(name, "") for name in ("pose_coordinates", "wrench_order")]
    units = [array.attrs.get("units", "") for array in found.variables.values()]
    arrays = found.data_vars.values()
    axes = [found[dim] for dim in dims if dim in found.coords]
    needed = {
        "without the name of a robot": isinstance(attributes.get("robot"), str),
        "whose status and rank are no whole numbers": all(
            found[name].dtype.kind in "iu" for name in ("status", "rank")
        ),
        "whose variables are over other poses": all(a.dims[: len(dims)] == dims for a in arrays),
        "with values that are no numbers": all(a.dtype.kind in "fiu" for a in (*arrays, *axes)),
        "with attributes that are no text": all(isinstance(text, str) for text in texts + units),
        "whose statuses are not listed": _is_listing(attributes.get("statuses", "{}")),
    }
    return next((words for words, holds in needed.items() if not holds), None)


def _is_listing(text: Any) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (TypeError, ValueError, RecursionError):
        return False


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
            elif f"{name}_units" in found.coords:
                unit = str(found[f"{name}_units"].values[index])
            heading = "_".join([str(name), *words])
            heading += "" if unit == "1" else f" [{unit}]"
            yield _field(heading), along, values[(..., *index)]


def _field(heading: str) -> str:
    """A heading as a single field that spreadsheets do not interpret as a formula."""
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
    units = {**POSE_UNITS, **coordinate_units(robot), "time": "s", "s": "m"}
    table = read_table(path, units, "pose")
    si = dict(table.si)
    time, path_length = si.pop("time", None), si.pop("s", None)
    place = table.columns[0].at
    if time is not None and path_length is not None:
        raise FileError(place, "columns time and s", expected="one of them")
    if not si:
        raise FileError(place, "columns", got="no coordinate", expected="at least one, such as x")
    poses = np.stack(list(si.values()), axis=-1)
    return PoseList(list(si), poses, time=time, path_length=path_length)
