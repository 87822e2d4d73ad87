"""Plots of maps: slices, isosurfaces, percentiles."""
