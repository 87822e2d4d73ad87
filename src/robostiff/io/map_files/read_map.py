"""Reading a map back from a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robostiff.analysis.maps.dataset import open_map
from robostiff.errors import InputError
from robostiff.io.map_files.netcdf import read_map_netcdf

if TYPE_CHECKING:
    import xarray


def read_map(path: str | Path) -> xarray.Dataset:
    """A map that was written to Zarr, read when its values are needed, or to NetCDF.

    Raises
    ------
    InputError
        When there is no such file, or it is no map, or damaged. Chunks of a store that are damaged
        raise it when they are read.
    """
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
