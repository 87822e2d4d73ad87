"""A map as an `xarray.Dataset`: filled in memory, or read from a store chunk by chunk."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import google_crc32c
import numpy as np
from zarr.storage import LocalStore

from robostiff.analysis.maps.job import MapJob, MapSummary
from robostiff.analysis.maps.layout import (
    coordinate_arrays,
    own_coordinates,
    range_attributes,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.maps.stored import IDENTITY, StoredArray, StoredMap, damaged, read_store
from robostiff.errors import InputError, needs_extra

if TYPE_CHECKING:
    import xarray


class MapArrays:
    """A map in memory; blocks may be filled by several threads.

    Parameters
    ----------
    job : MapJob
    attributes : mapping
        Of the map, known before it is computed.
    """

    def __init__(self, job: MapJob, attributes: Mapping[str, Any]) -> None:
        self.job = job
        self.attributes = attributes
        poses = job.partition.poses
        # Equal entries of all poses side by side: a block is a run in each of them.
        self._rows = {v.name: np.empty((*v.shape, poses), v.dtype) for v in job.variables}

    def compute(self, index: int) -> MapSummary:
        """Compute a block in its place."""
        run = slice(*self.job.partition.run(index))
        places = {name: rows[..., run] for name, rows in self._rows.items()}
        return self.job.compute(index, places).summary

    def dataset(self, summary: MapSummary) -> xarray.Dataset:
        """The map, once all blocks are there."""
        import xarray

        job = self.job
        ranges = range_attributes(summary)
        arrays: dict[str, Any] = {}
        for variable in job.variables:
            own = len(variable.shape)
            rows = self._rows[variable.name].reshape(*variable.shape, *job.partition.shape)
            poses_first = np.moveaxis(rows, range(own), range(-own, 0))
            attributes = variable_attributes(job, variable) | ranges.get(variable.name, {})
            arrays[variable.name] = ((*job.source.dims, *variable.dims), poses_first, attributes)
        for name, coordinate in coordinate_arrays(job).items():
            arrays[name] = (coordinate.dims, coordinate.values, dict(coordinate.attributes))
        made = xarray.Dataset(arrays, attrs={**self.attributes, **summary_attributes(summary)})
        return made.set_coords(own_coordinates(job))


def open_map(path: Path) -> xarray.Dataset:
    """The map in a store, read and checked when its values are asked for."""
    with needs_extra("maps", "maps"):
        import xarray

    stored = read_store(path)
    store: Any = CheckedChunks(stored)
    try:
        found = xarray.open_zarr(store, consolidated=False, zarr_format=3)
    except InputError:
        raise
    except Exception as error:  # any failure of Zarr at a store of another program
        raise damaged(
            path, f"contents that Zarr cannot read ({type(error).__name__}: {error})"
        ) from None
    about = found.attrs.pop(IDENTITY)
    ordered = [name for name in about["variables"] if name in found.data_vars]
    words = {
        name: found[name].copy(data=np.array(found[name].values.tolist()))
        for name in found.coords
        if found[name].dtype.kind == "T"  # NetCDF and older programs know no such texts
    }
    return found[ordered].assign_coords(words)


_CHECKSUM = 4
_BLOSC_HEADER = 16


class CheckedChunks(LocalStore):
    """The files of a map, to be read through Zarr.

    Parameters
    ----------
    stored : StoredMap
    read_only : bool
        Always; Zarr asks.
    """

    def __init__(self, stored: StoredMap, *, read_only: bool = True) -> None:
        super().__init__(stored.path, read_only=read_only)
        self.stored = stored

    def with_read_only(self, read_only: bool = False) -> CheckedChunks:
        """The same."""
        return CheckedChunks(self.stored, read_only=read_only)

    async def get(self, key: str, *args: Any, **kwargs: Any) -> Any:
        """A file, checked where it is a chunk."""
        try:
            found = await super().get(key, *args, **kwargs)
        except OSError as error:
            raise damaged(self.stored.path, f"{key} that cannot be read ({error})") from None
        return self._checked(key, found)

    def get_sync(self, key: str, **kwargs: Any) -> Any:
        """As `get`."""
        try:
            found = super().get_sync(key, **kwargs)
        except OSError as error:
            raise damaged(self.stored.path, f"{key} that cannot be read ({error})") from None
        return self._checked(key, found)

    def _checked(self, key: str, found: Any) -> Any:
        name, is_chunk, _ = key.partition("/c")
        array = self.stored.arrays.get(name)
        if not is_chunk or array is None:
            return found
        if found is None:
            if self.stored.identity["complete"]:
                raise damaged(self.stored.path, f"no {key}")
            return None  # not computed yet
        if not is_sound(found.to_bytes(), array):
            raise damaged(self.stored.path, f"{key} that does not agree with its checksum")
        return found


def is_sound(chunk: bytes, array: StoredArray) -> bool:
    """Whether a chunk has its checksum, and the size that its array says."""
    content = memoryview(chunk)[:-_CHECKSUM]
    if len(content) + _CHECKSUM != len(chunk):
        return False
    if google_crc32c.value(bytes(content)) != int.from_bytes(chunk[-_CHECKSUM:], "little"):
        return False
    if array.is_packed:
        if len(content) < _BLOSC_HEADER:
            return False
        unpacked = int.from_bytes(content[4:8], "little")
        packed = int.from_bytes(content[12:16], "little")
        return unpacked == array.chunk_bytes and packed == len(content)
    if array.bytes_a_value:
        return len(content) == array.chunk_bytes
    return int.from_bytes(content[:4], "little") == math.prod(array.chunk)
