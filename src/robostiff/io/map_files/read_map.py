"""Reading a map back from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robostiff.analysis.maps.dataset import open_map
from robostiff.errors import InputError
from robostiff.io.map_files.netcdf import check_netcdf

if TYPE_CHECKING:
    import xarray


def read_map(path: str | Path) -> xarray.Dataset:
    """A map that was written to Zarr or NetCDF, read when its values are needed.

    Raises
    ------
    InputError
        When there is no such file, or it is no map.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("map", got=str(path), expected="a file or store that is there")
    if path.suffix == ".zarr":
        try:
            found = open_map(path)
        except (OSError, KeyError, ValueError):
            raise InputError(
                "map", got=str(path), expected="a store that robostiff map has written"
            ) from None
    elif path.suffix == ".nc":
        check_netcdf()
        import xarray

        try:
            found = xarray.open_dataset(path, engine="h5netcdf")
        except OSError as error:
            raise InputError("map", got=str(path), expected=f"a NetCDF file ({error})") from None
    else:
        raise InputError(
            "map",
            got=path.name,
            expected="a store .zarr or a file .nc",
            hint="robostiff map ROBOT ... -o map.zarr writes one",
        )
    if "status" not in found or "robot" not in found.attrs:
        raise InputError("map", got=str(path), expected="what robostiff map has written")
    return found
