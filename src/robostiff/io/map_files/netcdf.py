"""A map as a NetCDF file, and maps read from any of their files."""

from __future__ import annotations

import hashlib
import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.dataset import open_map
from robostiff.errors import FileError, InputError, Location, needs_extra
from robostiff.io.child_process import READ_HDF5, ProcessLimits, answer_of
from robostiff.io.whole_file import whole_file

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
        raise _damaged(path, "a content that does not agree with its checksum")
    _try_elsewhere(path, size)
    try:
        with xarray.open_dataset(path, engine="h5netcdf") as found:
            return found.load()
    except Exception as error:  # any failure of HDF5 or xarray at a file of another program
        raise _damaged(
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
        content = file.read(8)
        if content != b"\x89HDF\r\n\x1a\n":
            return False
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
        raise _damaged(path, f"contents that HDF5 cannot read ({error.got})") from None


def _damaged(path: Path, what: str) -> InputError:
    return InputError(
        f"map {str(path)!r} is damaged: it has {what}",
        hint="make the map again, or take a copy of it",
    )


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
