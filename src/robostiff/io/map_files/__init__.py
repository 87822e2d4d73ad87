"""Files of maps: poses from CSV, maps as CSV and NetCDF."""

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
