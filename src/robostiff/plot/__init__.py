"""Plots of results: on paper with Matplotlib, scenes in the browser with Plotly.

Every function takes results, draws a picture on a backend, and returns what the backend makes of
it: Matplotlib's axes or a figure of Plotly. Nothing is shown, and no setting of either is changed.
Pictures are computed without them as data, in ``picture``; ``geometry`` finds the
lines of legs, bent or not, of screws, ellipsoids and isosurfaces.
"""

from robostiff.plot.backend import Matplotlib, PictureData, PlotBackend, Plotly, Width
from robostiff.plot.curves import load_curve
from robostiff.plot.energy_bars import Measure, comparison, energy_shares
from robostiff.plot.geometry.ellipsoid import Quality
from robostiff.plot.maps.pictures import map_bands, map_isosurface, map_overview, map_slice
from robostiff.plot.posed_robot import Colouring, equilibrium, mode, robot
from robostiff.plot.stiffness_pictures import Kind, Shade, ellipsoid, free_motions, matrix
from robostiff.plot.theme import Theme

__all__ = [
    "Colouring",
    "Kind",
    "Matplotlib",
    "Measure",
    "PictureData",
    "PlotBackend",
    "Plotly",
    "Quality",
    "Shade",
    "Theme",
    "Width",
    "comparison",
    "ellipsoid",
    "energy_shares",
    "equilibrium",
    "free_motions",
    "load_curve",
    "map_bands",
    "map_isosurface",
    "map_overview",
    "map_slice",
    "matrix",
    "mode",
    "robot",
]
