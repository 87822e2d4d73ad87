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
    Series,
)
from robostiff.plot.picture.paint import Axis, Category, ColourScale, Paint, Ramp, Tone
from robostiff.plot.picture.scene import Arrow, Face, Item, Marks, Mesh, Path, Scene, Shape, Weight

Picture = Scene | Matrix | Bars | Field | Bands

__all__ = [
    "Arrow",
    "Axis",
    "Bands",
    "Bars",
    "Category",
    "ColourScale",
    "Cover",
    "Face",
    "Field",
    "Group",
    "Item",
    "Marks",
    "Matrix",
    "Mesh",
    "Paint",
    "Panel",
    "Path",
    "Percentile",
    "Picture",
    "QuarterUnit",
    "Ramp",
    "Region",
    "Scene",
    "Series",
    "Shape",
    "Tone",
    "Weight",
]
