"""Files of maps: poses from CSV, maps as CSV and NetCDF."""

from robostiff.io.map_files.comma_separated import map_csv_lines, write_map_csv
from robostiff.io.map_files.netcdf import check_netcdf, write_map_netcdf
from robostiff.io.map_files.poses import read_poses

__all__ = ["check_netcdf", "map_csv_lines", "read_poses", "write_map_csv", "write_map_netcdf"]
