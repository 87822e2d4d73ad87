"""Maps as CSV and NetCDF files, and read from any of their files; poses from CSV."""

from robostiff.io.map_files.maps import (
    check_netcdf,
    map_csv_lines,
    read_map,
    write_map_csv,
    write_map_netcdf,
)
from robostiff.io.map_files.poses import read_poses

__all__ = [
    "check_netcdf",
    "map_csv_lines",
    "read_map",
    "read_poses",
    "write_map_csv",
    "write_map_netcdf",
]
