"""A map as an `xarray.Dataset`: filled in memory, or opened from a store."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.maps.extra import maps_extra
from robostiff.analysis.maps.job import MapJob
from robostiff.analysis.maps.layout import (
    coordinate_arrays,
    own_coordinates,
    range_attributes,
    summary_attributes,
    variable_attributes,
)
from robostiff.analysis.maps.stored import IDENTITY, damaged, read_store
from robostiff.analysis.maps.summary import MapSummary
from robostiff.errors import InputError

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
    """The map in a store, read and checked when its values are asked for.

    Raises
    ------
    InputError
        When it is damaged: now, or when the damaged values are read.
    """
    with maps_extra():
        import xarray

        from robostiff.analysis.maps.checked_chunks import CheckedChunks
    stored = read_store(path)
    store: Any = CheckedChunks(stored)
    try:
        found = xarray.open_zarr(store, consolidated=False, zarr_format=3)
    except InputError:
        raise
    except Exception as error:  # whatever Zarr makes of what robostiff has not written
        raise damaged(path, f"what Zarr cannot read ({type(error).__name__}: {error})") from None
    about = found.attrs.pop(IDENTITY)
    ordered = [name for name in about["variables"] if name in found.data_vars]
    words = {
        name: found[name].copy(data=np.array(found[name].values.tolist()))
        for name in found.coords
        if found[name].dtype.kind == "T"  # NetCDF and older programs know no such texts
    }
    return found[ordered].assign_coords(words)
