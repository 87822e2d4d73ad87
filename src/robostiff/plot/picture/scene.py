"""Lines, faces and marks in space, and the meanings of their colours."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from robostiff.plot.theme import Palette

_TO_THE_RIGHT = np.array([0.79, 0.62])  # as spaces are seen at first
_NEAR_EDGE = 0.2  # of the diagonal of the floor


class LineWeight(Enum):
    """Width of a line, in points."""

    THIN = 0.9
    LINE = 1.6
    BOLD = 3.2


class Shape(Enum):
    """Shape of a mark."""

    RING = "ring"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "cross"
    DOT = "dot"


@dataclass(frozen=True)
class Path:
    """A line through points (n, 3); `label` is its name in the legend, `about` its description."""

    points: np.ndarray
    paint: Paint
    weight: LineWeight = LineWeight.LINE
    dashed: bool = False
    label: str = ""
    about: str = ""


@dataclass(frozen=True)
class Face:
    """A plane face with corners (n, 3)."""

    corners: np.ndarray
    paint: Paint
    opacity: float = 0.35
    label: str = ""


@dataclass(frozen=True)
class Marks:
    """Marks at points (n, 3)."""

    points: np.ndarray
    paint: Paint
    shape: Shape
    label: str = ""
    about: tuple[str, ...] = ()


@dataclass(frozen=True)
class Arrow:
    """An arrow from a start (3,) to a tip (3,); two-headed for a motion both ways."""

    start: np.ndarray
    tip: np.ndarray
    paint: Paint
    label: str = ""
    both_ways: bool = False


@dataclass(frozen=True)
class Mesh:
    """A surface of triangles (m, 3) between vertices (n, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray
    paint: Paint
    opacity: float = 0.3
    label: str = ""


@dataclass(frozen=True)
class Text:
    """Words beside a point (3,)."""

    point: np.ndarray
    words: str
    paint: Paint
    label: str = ""


Item = Path | Face | Marks | Arrow | Mesh | Text


@dataclass(frozen=True)
class Scene:
    """Lines, faces and marks of a picture in space."""

    title: str
    axes: tuple[str, str, str]  # labels of x, y, z with their units
    items: tuple[Item, ...]  # coordinates in the units of the axes
    scale: ColourScale | None = None  # of the paints that are numbers
    is_flat: bool = False  # whether everything lies in the x-y plane and is viewed from above
    is_equal: bool = True  # whether all axes have one unit and one scale
    notes: tuple[str, ...] = ()  # notes for the reader, one on each line
    # (2, 3) or None: opposite corners of what the axes show, whatever is drawn
    frame: np.ndarray | None = None

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) of the range of the axes."""
        parts = [_points(item) for item in self.items]
        if self.frame is not None:
            parts.append(self.frame)
        points = np.concatenate(parts)
        return points.min(axis=0), points.max(axis=0)

    def is_on_the_right(self, point: np.ndarray) -> bool:
        """Whether a point (3,) of a space is seen near the right edge, where axes have numbers."""
        low, high = self.box
        across = float((point - 0.5 * (low + high))[:2] @ _TO_THE_RIGHT)
        return not self.is_flat and across > _NEAR_EDGE * float(np.linalg.norm((high - low)[:2]))


def _points(item: Item) -> np.ndarray:
    if isinstance(item, Path | Marks):
        return item.points
    if isinstance(item, Face):
        return item.corners
    if isinstance(item, Arrow):
        return np.stack([item.start, item.tip])
    if isinstance(item, Text):
        return item.point[None]
    return item.vertices


class PlainColour(Enum):
    """Colours that need no legend."""

    INK = "ink"
    MUTED = "muted"
    FAINT = "faint"
    PLATE = "plate"


@dataclass(frozen=True)
class Category:
    """One of several categories with different colours."""

    index: int


class Ramp(Enum):
    """Colours of values."""

    VALUES = "values"
    SIGNED = "signed"

    def stops(self, palette: Palette) -> tuple[str, ...]:
        """Its colours in a theme, low to high."""
        return palette.values if self is Ramp.VALUES else palette.signed


@dataclass(frozen=True)
class ColourScale:
    """Scale from values to colours."""

    label: str  # what the values are, with their unit
    low: float  # the value at the lower end
    high: float
    ramp: Ramp = Ramp.VALUES
    # values named beside the scale; empty to leave the choice to the backend
    ticks: tuple[tuple[float, str], ...] = ()

    def place(self, value: float) -> float:
        """Position of a value on the ramp, 0 to 1."""
        width = self.high - self.low
        return 0.5 if width <= 0 else float(np.clip((value - self.low) / width, 0.0, 1.0))


# A number is a value on the colour scale of its picture.
Paint = PlainColour | Category | float


def colour_of(paint: Paint, palette: Palette, scale: ColourScale | None = None) -> str:
    """The colour #rrggbb of a paint in a theme.

    Examples
    --------
    >>> from robostiff.plot.theme import Theme
    >>> colour_of(Category(0), Theme.LIGHT.palette)
    '#0072B2'
    """
    if isinstance(paint, PlainColour):
        return getattr(palette, paint.value)
    if isinstance(paint, Category):
        return palette.categories[paint.index % len(palette.categories)]
    if scale is None:
        return palette.muted
    return palette.along(scale.ramp.stops(palette), scale.place(paint))


@dataclass(frozen=True)
class PlotAxis:
    """Name, unit and values of an axis."""

    label: str  # with its unit
    values: np.ndarray
