"""Plots of results: on paper with Matplotlib, scenes in the browser with Plotly.

Every function takes results, draws a picture on a backend, and returns the axes of Matplotlib or a
figure of Plotly. Nothing is shown, and no setting of either is changed. Pictures are computed as
data, in ``picture``; ``outline`` and ``sketch`` have lines of machines, bent or not, ``surfaces``
ellipsoids, screws and isosurfaces. `layers_of` gives the items of a picture to programs that draw
them by themselves.
"""

from robostiff.plot.backend import Matplotlib as Matplotlib
from robostiff.plot.backend import PictureData as PictureData
from robostiff.plot.backend import PlotBackend as PlotBackend
from robostiff.plot.backend import Plotly as Plotly
from robostiff.plot.backend import Width as Width
from robostiff.plot.bars_and_curves import Measure as Measure
from robostiff.plot.bars_and_curves import comparison as comparison
from robostiff.plot.bars_and_curves import energy_shares as energy_shares
from robostiff.plot.bars_and_curves import load_curve as load_curve
from robostiff.plot.layers import LAYERS as LAYERS
from robostiff.plot.layers import Layers as Layers
from robostiff.plot.layers import layers_of as layers_of
from robostiff.plot.map_pictures import map_bands as map_bands
from robostiff.plot.map_pictures import map_isosurface as map_isosurface
from robostiff.plot.map_pictures import map_overview as map_overview
from robostiff.plot.map_pictures import map_slice as map_slice
from robostiff.plot.picture import Arrow as Arrow
from robostiff.plot.picture import Category as Category
from robostiff.plot.picture import Face as Face
from robostiff.plot.picture import Item as Item
from robostiff.plot.picture import LineWeight as LineWeight
from robostiff.plot.picture import Marks as Marks
from robostiff.plot.picture import Mesh as Mesh
from robostiff.plot.picture import Paint as Paint
from robostiff.plot.picture import Path as Path
from robostiff.plot.picture import PlainColour as PlainColour
from robostiff.plot.picture import Shape as Shape
from robostiff.plot.picture import Text as Text
from robostiff.plot.picture import colour_of as colour_of
from robostiff.plot.posed_robot import Colouring as Colouring
from robostiff.plot.posed_robot import equilibrium as equilibrium
from robostiff.plot.posed_robot import mode as mode
from robostiff.plot.posed_robot import robot as robot
from robostiff.plot.stiffness_pictures import Kind as Kind
from robostiff.plot.stiffness_pictures import Shade as Shade
from robostiff.plot.stiffness_pictures import ellipsoid as ellipsoid
from robostiff.plot.stiffness_pictures import free_motions as free_motions
from robostiff.plot.stiffness_pictures import matrix as matrix
from robostiff.plot.surfaces import Quality as Quality
from robostiff.plot.theme import Theme as Theme
