"""Plots of results: on paper with Matplotlib, scenes in the browser with Plotly.

Every function takes results, draws a picture on a backend, and returns the axes of Matplotlib or a
figure of Plotly. Nothing is shown, and no setting of either is changed. Pictures are computed as
data, in ``picture``; ``outline`` and ``sketch`` have lines of machines, bent or not, ``surfaces``
ellipsoids, screws and isosurfaces. `layers_of` gives the items of a picture to programs that draw
them by themselves.
"""

from robostiff.plot.backend import Matplotlib, PictureData, PlotBackend, Plotly, Width
from robostiff.plot.bars_and_curves import Measure, comparison, energy_shares, load_curve
from robostiff.plot.layers import LAYERS, Layers, layers_of
from robostiff.plot.map_pictures import map_bands, map_isosurface, map_overview, map_slice
from robostiff.plot.picture import (
    Arrow,
    Category,
    Face,
    Item,
    LineWeight,
    Marks,
    Mesh,
    Paint,
    Path,
    PlainColour,
    Shape,
    Text,
    colour_of,
)
from robostiff.plot.posed_robot import Colouring, equilibrium, mode, robot
from robostiff.plot.stiffness_pictures import Kind, Shade, ellipsoid, free_motions, matrix
from robostiff.plot.surfaces import Quality
from robostiff.plot.theme import Theme

__all__ = [
    "LAYERS",
    "Arrow",
    "Category",
    "Colouring",
    "Face",
    "Item",
    "Kind",
    "Layers",
    "LineWeight",
    "Marks",
    "Matplotlib",
    "Measure",
    "Mesh",
    "Paint",
    "Path",
    "PictureData",
    "PlainColour",
    "PlotBackend",
    "Plotly",
    "Quality",
    "Shade",
    "Shape",
    "Text",
    "Theme",
    "Width",
    "colour_of",
    "comparison",
    "ellipsoid",
    "energy_shares",
    "equilibrium",
    "free_motions",
    "layers_of",
    "load_curve",
    "map_bands",
    "map_isosurface",
    "map_overview",
    "map_slice",
    "matrix",
    "mode",
    "robot",
]
