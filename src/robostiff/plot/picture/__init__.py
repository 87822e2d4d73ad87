"""Pictures as data, in the units of their labels, independent of a backend."""

from robostiff.plot.picture.charts import (
    Bands,
    Bars,
    Cover,
    Field,
    Group,
    Matrix,
    Panel,
    Percentile,
    QuarterUnit,
    Region,
    RegionStyle,
    Series,
)
from robostiff.plot.picture.paint import Category, ColourScale, Paint, PlainColour, PlotAxis, Ramp
from robostiff.plot.picture.scene import (
    Arrow,
    Face,
    Item,
    LineWeight,
    Marks,
    Mesh,
    Path,
    Scene,
    Shape,
)

Picture = Scene | Matrix | Bars | Field | Bands

__all__ = [
    "Arrow",
    "Bands",
    "Bars",
    "Category",
    "ColourScale",
    "Cover",
    "Face",
    "Field",
    "Group",
    "Item",
    "LineWeight",
    "Marks",
    "Matrix",
    "Mesh",
    "Paint",
    "Panel",
    "Path",
    "Percentile",
    "Picture",
    "PlainColour",
    "PlotAxis",
    "QuarterUnit",
    "Ramp",
    "Region",
    "RegionStyle",
    "Scene",
    "Series",
    "Shape",
]
