"""Maps as NetCDF files, and read from stores and files; poses from CSV."""

from __future__ import annotations

import io
import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.analysis.maps import PoseList
from robostiff.analysis.maps.pose_columns import POSE_UNITS, Mapped, coordinate_units
from robostiff.analysis.maps.store import damage_error, open_map
from robostiff.errors import FileError, InputError, Location, Words, needs_extra
from robostiff.io.child_process import READ_HDF5, ProcessLimits, answer_of
from robostiff.io.csv_table import read_table
from robostiff.model import Snapshot
from robostiff.whole_file import whole_file

if TYPE_CHECKING:
    import xarray


# Of a variable in memory, and of a chunk in a file.
_BLOCK_BYTES, _CHUNK_BYTES = 2**23, 2**20
_SECONDS, _BYTES_A_SECOND = 20, 5_000_000
_MOST_EXPANSION = 1100  # of deflate


class _DelayingFile(io.FileIO):
    """A file whose first error waits until all is written: HDF5 fails badly on a full disk."""

    error: OSError | None = None

    def write(self, content: Any) -> int:
        """Write all of it, or keep the error."""
        rest = memoryview(content).cast("B")
        try:
            while rest:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.error = self.error or error
        return len(content)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


def write_map_netcdf(found: xarray.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a map as NetCDF 4, block by block, whole or not at all.

    Every chunk has a checksum (fletcher32). A map that is read from a store is never in memory.

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
    import h5netcdf

    with whole_file(path) as draft, _DelayingFile(draft, "wb+") as file:
        # a chunk of two blocks stays in the cache until both are there
        with h5netcdf.File(file, "w", rdcc_nbytes=2 * _CHUNK_BYTES) as whole:
            whole.dimensions = {str(name): size for name, size in found.sizes.items()}
            whole.attrs.update({name: text for name, text in found.attrs.items() if text != ""})
            for name, array in found.variables.items():
                # names of the coordinates of a quantity that are no dimensions
                near = {n: set(c.dims) for n, c in found.coords.items() if n not in found.dims}
                names = [str(n) for n, dims in near.items() if dims <= set(array.dims)]
                text = " ".join(names) if name in found.data_vars else ""
                _write_variable(whole, str(name), array, text)
        if file.error is not None:
            raise file.error


def _write_variable(whole: Any, name: str, array: xarray.Variable, coordinates: str) -> None:
    """A variable with its attributes, by blocks of those that it has in a store or of some MB."""
    import h5py

    kind, options = array.dtype.kind, {}
    if array.size and array.ndim and kind != "U":
        if array.chunks is None:
            rows = max(1, _BLOCK_BYTES * len(array) // (array.size * array.dtype.itemsize))
            array = array.to_base_variable().chunk({array.dims[0]: rows})
        chunk = [sizes[0] for sizes in array.chunks or ()]
        # HDF5 takes several times the memory of a chunk: cut along the first of several places
        axis = next((k for k, n in enumerate(chunk) if n > 1), 0)
        parts = -(-math.prod(chunk) * array.dtype.itemsize // _CHUNK_BYTES)
        chunk[axis] = -(-chunk[axis] // parts)
        options = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        options |= {"fletcher32": True, "chunks": tuple(chunk)}
    missing = np.nan if kind == "f" else None
    dtype = h5py.string_dtype() if kind == "U" else array.dtype
    made = whole.create_variable(name, array.dims, dtype, fillvalue=missing, **options)
    for key, value in {**array.attrs, "coordinates": coordinates}.items():
        if key in ("flag_masks", "flag_values", "actual_range"):
            made.attrs[key] = np.array(value, array.dtype)  # CF requires the type of the variable
        elif not isinstance(value, str) or value:
            made.attrs[key] = value
    if not options:
        made[...] = array.values.astype(object) if kind == "U" else array.values
        return
    starts, values = [np.cumsum((0, *sizes)) for sizes in array.chunks or ()], cast(Any, array.data)
    for block in np.ndindex(*(len(edges) - 1 for edges in starts)):
        part = tuple(slice(edges[k], edges[k + 1]) for edges, k in zip(starts, block, strict=True))
        made[part] = values.blocks[block].compute(scheduler="synchronous")


def read_map_netcdf(path: Path) -> xarray.Dataset:
    """All of a NetCDF file; first another process tries to read it, within limits."""
    check_netcdf()
    import xarray

    size = path.stat().st_size
    expanded = _MOST_EXPANSION * size
    limits = ProcessLimits(2**31 + expanded, _SECONDS + size // _BYTES_A_SECOND)
    request = {"path": str(path), "expanded": expanded}
    try:
        answer_of(READ_HDF5, request, Location(str(path)), "map", "HDF5", limits)
        with xarray.open_dataset(path, engine="h5netcdf") as dataset:
            return dataset.load()
    except FileError as error:
        raise damage_error(path, f"contents that HDF5 cannot read ({error.got})") from None
    except Exception as error:  # any failure of HDF5 or xarray at a file of another program
        words = f"contents that cannot be read ({type(error).__name__}: {error})"
        raise damage_error(path, words) from None


def check_netcdf() -> None:
    """Raise when the packages for NetCDF are not installed; to be called before the computation."""
    with needs_extra("maps", "maps"):
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401


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
        dataset = open_map(path)
    elif path.suffix == ".nc":
        dataset = read_map_netcdf(path)
    else:
        got = path.name or str(path)
        hint = "robostiff map ROBOT ... -o map.zarr writes one"
        raise InputError("map", got=got, expected="a store .zarr or a file .nc", hint=hint)
    if why := _is_no_map(dataset):
        raise InputError(f"map {str(path)!r}: a dataset {why}, which is no map of robostiff")
    return dataset


def _is_no_map(dataset: xarray.Dataset) -> str | None:
    """The reason why a dataset is not a map of robostiff; None for a map."""
    if not {"status", "rank"} <= set(dataset.data_vars):
        return "without the variables status and rank"
    dims, attributes = dataset["status"].dims, dataset.attrs
    texts = [attributes.get(name, "") for name in ("pose_coordinates", "wrench_order")]
    units = [array.attrs.get("units", "") for array in dataset.variables.values()]
    arrays = dataset.data_vars.values()
    axes = [dataset[dim] for dim in dims if dim in dataset.coords]
    needed = {
        "without the name of a robot": isinstance(attributes.get("robot"), str),
        "whose status and rank are no whole numbers": all(
            dataset[name].dtype.kind in "iu" for name in ("status", "rank")
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
        raise FileError(
            place, "columns", got=Words("no coordinate"), expected="at least one, such as x"
        )
    poses = np.stack(list(si.values()), axis=-1)
    return PoseList(list(si), poses, time=time, path_length=path_length)
