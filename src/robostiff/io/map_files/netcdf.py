"""A map as a NetCDF file."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.maps.extra import maps_extra
from robostiff.io.whole_file import whole_file

if TYPE_CHECKING:
    import xarray

_FLAGS = ("flag_masks", "flag_values")


def write_map_netcdf(found: xarray.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a map as NetCDF 4, whole or not at all.

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
        # CF wants flags and ranges in the type of their variable.
        for name in (*_FLAGS, "actual_range"):
            if name in variable.attrs:
                variable.attrs = {
                    **variable.attrs,
                    name: np.array(variable.attrs[name], dtype=variable.dtype),
                }
    encoding = {
        name: {"zlib": True, "complevel": 1, "shuffle": True} if array.ndim else {}
        for name, array in written.data_vars.items()
    }
    with whole_file(path) as begun:
        written.to_netcdf(begun, engine="h5netcdf", encoding=encoding)


def check_netcdf() -> None:
    """Raise when what writes NetCDF is not installed; to be called before the work, not after.

    Raises
    ------
    InputError
    """
    with maps_extra():
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401
