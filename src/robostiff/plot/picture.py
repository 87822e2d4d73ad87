"""Pictures as data, in the units of their labels, independent of a backend."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from robostiff.errors import printable
from robostiff.frozen import frozen, replace
from robostiff.plot.surfaces import perpendicular
from robostiff.plot.theme import Palette

_TO_THE_RIGHT = np.array([0.79, 0.62])  # as spaces are seen at first
_NEAR_EDGE = 0.2  # of the diagonal of the floor
_HEAD = 0.05  # of the picture: an arrow head


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


@frozen
class Path:
    """A line through points (n, 3); `label` is its name in the legend, `about` its description."""

    points: np.ndarray
    paint: Paint
    weight: LineWeight = LineWeight.LINE
    dashed: bool = False
    label: str = ""
    about: str = ""


@frozen
class Face:
    """A plane face with corners (n, 3)."""

    corners: np.ndarray
    paint: Paint
    opacity: float = 0.35
    label: str = ""

    @property
    def fan(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices and triangles around its middle: plates are star-shaped."""
        n, around = len(self.corners), np.arange(len(self.corners))
        vertices = np.concatenate([self.corners, self.corners.mean(axis=0)[None]])
        return vertices, np.stack([around, (around + 1) % n, np.full(n, n)], axis=-1)


@frozen
class Marks:
    """Marks at points (n, 3)."""

    points: np.ndarray
    paint: Paint
    shape: Shape
    label: str = ""
    about: tuple[str, ...] = ()


@frozen
class Arrow:
    """An arrow from a start (3,) to a tip (3,); two-headed for a motion both ways."""

    start: np.ndarray
    tip: np.ndarray
    paint: Paint
    label: str = ""
    both_ways: bool = False

    def heads(self, size: float) -> Iterator[tuple[np.ndarray, ...]]:
        """Of each head in a picture of some size: its tip, its foot, two vectors across it (3,)."""
        ends = [(self.tip, self.start), (self.start, self.tip)]
        for tip, other in ends if self.both_ways else ends[:1]:
            e = (tip - other) / (np.linalg.norm(tip - other) or 1.0)
            across = perpendicular(e)
            length = _HEAD * size
            yield tip, tip - length * e, length * across, length * np.cross(e, across)


@frozen
class Mesh:
    """A surface of triangles (m, 3) between vertices (n, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray
    paint: Paint
    opacity: float = 0.3
    label: str = ""


@frozen
class Text:
    """Words beside a point (3,)."""

    point: np.ndarray
    words: str
    paint: Paint
    label: str = ""


Item = Path | Face | Marks | Arrow | Mesh | Text


@frozen
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
        parts = [] if self.frame is None else [self.frame]
        for item in self.items:
            match item:
                case Arrow(start, tip):
                    parts.append(np.stack([start, tip]))
                case Text(point):
                    parts.append(point[None])
                case Path(points) | Marks(points) | Face(points) | Mesh(points):
                    parts.append(points)
        points = np.concatenate(parts)
        return points.min(axis=0), points.max(axis=0)

    @property
    def size(self) -> float:
        """Length of the diagonal of its box."""
        low, high = self.box
        return float(np.linalg.norm(high - low)) or 1.0

    def is_on_the_right(self, point: np.ndarray) -> bool:
        """Whether a point (3,) of a space is seen near the right edge, where axes have numbers."""
        low, high = self.box
        across = float((point - 0.5 * (low + high))[:2] @ _TO_THE_RIGHT)
        return not self.is_flat and across > _NEAR_EDGE * float(np.linalg.norm((high - low)[:2]))


class PlainColour(Enum):
    """Colours that need no legend."""

    INK = "ink"
    MUTED = "muted"
    FAINT = "faint"
    PLATE = "plate"


@frozen
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


@frozen
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
    """The colour #rrggbb of a paint in a theme."""
    if isinstance(paint, PlainColour):
        return getattr(palette, paint.value)
    if isinstance(paint, Category):
        return palette.categories[paint.index % len(palette.categories)]
    if scale is None:
        return palette.muted
    return palette.along(scale.ramp.stops(palette), scale.place(paint))


@frozen
class PlotAxis:
    """Name, unit and values of an axis."""

    label: str  # with its unit
    values: np.ndarray


@frozen
class Series:
    """One bar in every group."""

    name: str
    paint: Paint
    values: np.ndarray  # (groups,): NaN where there is no bar
    texts: tuple[str, ...] = ()  # written at each bar; empty for none


@frozen
class Panel:
    """Bars with one unit."""

    label: str  # of the axis of values, with its unit
    groups: tuple[str, ...]  # their names
    series: tuple[Series, ...]
    notes: tuple[str, ...] = ()  # about each group


@frozen
class Bars:
    """Panels of bars."""

    title: str
    panels: tuple[Panel, ...]  # of the same series
    is_stacked: bool = False  # whether the bars of a group lie one after another
    notes: tuple[str, ...] = ()


# Regions of maps, the first that applies first, and their looks, the same in all pictures: hatching
# as Matplotlib writes it, and a category of the palette or a part of grey on the ground; none of
# those over values that are visible.
REGIONS: dict[str, tuple[str, int | float | None]] = {
    "not-computed": ("--", 0.35),
    "excluded": ("..", 0.15),
    "unreachable": ("////", 0.55),
    "infeasible": ("//", 4),
    "rigid-direction": ("++", 5),
    "form-does-not-hold": ("||", 3),
    "unbalanced": ("\\\\\\\\", 2),
    "rank-deficient": ("xxxx", 1),
    "no value": ("xx", 0.2),
    "ill-conditioned": ("\\\\", None),
    "beyond-limits": ("...", None),
}
_TINT = 0.38


@frozen
class RegionStyle:
    """Properties of a patch of Matplotlib: the fill is ``none`` over values."""

    facecolor: str
    hatch: str
    edgecolor: str
    linewidth: float = 0.0


@frozen
class Region:
    """Poses that are marked, such as unreachable ones."""

    name: str
    where: np.ndarray  # of the shape of the values
    # A plain colour in place of them: of a category, or at a place from 0 to 1 among values
    paint: Category | float | None = None

    def style(self, palette: Palette) -> RegionStyle:
        """Its look: the same for the same reason, in every picture."""
        if self.paint is not None:
            fill = (
                palette.along(palette.values, self.paint)
                if isinstance(self.paint, float)
                else colour_of(self.paint, palette)
            )
            return RegionStyle(fill, "", fill)
        hatch, tint = REGIONS[self.name]
        if tint is None:
            return RegionStyle("none", hatch, palette.ground)
        if isinstance(tint, float):
            fill = palette.along((palette.ground, palette.faint), tint)
            return RegionStyle(fill, hatch, palette.muted)
        colour = palette.categories[tint]
        return RegionStyle(palette.along((palette.ground, colour), _TINT), hatch, colour)

    def key_style(self, palette: Palette) -> RegionStyle:
        """Its look where there are no values below it, as in a legend."""
        style = self.style(palette)
        return replace(style, facecolor=palette.values[3]) if self.is_over else style

    @property
    def is_over(self) -> bool:
        """Whether it is hatched over values, which stand below it."""
        return self.paint is None and REGIONS[self.name][1] is None

    @property
    def reason(self) -> str:
        """Its name beside values, which some poses do not have."""
        has_none = self.paint is None and not self.is_over
        return f"no value: {self.name}" if has_none else self.name


@frozen
class Field:
    """Values over a plane."""

    title: str
    x: PlotAxis
    y: PlotAxis
    values: np.ndarray  # (y, x): NaN where a region stands instead
    scale: ColourScale | None  # None where regions alone are shown
    regions: tuple[Region, ...] = ()
    isolines: tuple[float, ...] = ()  # values along which lines are drawn
    notes: tuple[str, ...] = ()


@frozen
class Bands:
    """Percentiles along a coordinate, and the shares of poses in regions."""

    title: str
    x: PlotAxis
    label: str  # of the values, with their unit
    # ascending, the median in the middle; none of ranks and statuses, which are shares alone
    percents: tuple[float, ...]
    values: np.ndarray  # (percents, n): below them these parts of the poses lie; NaN for none
    shares: tuple[Region, ...] = ()  # ``where`` holds the share of poses, 0 to 1
    notes: tuple[str, ...] = ()


@frozen
class Curve:
    """A curve."""

    name: str
    # (n,): NaN where it is interrupted
    x: np.ndarray
    y: np.ndarray
    paint: Category
    is_dashed: bool = False
    has_marks: bool = False


@frozen
class Curves:
    """Curves over common axes."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    notes: tuple[str, ...] = ()
    is_log: bool = False  # whether y grows by factors


@frozen
class Matrix:
    """A matrix with its numbers."""

    title: str
    rows: tuple[str, ...]  # names
    columns: tuple[str, ...]  # names
    texts: tuple[tuple[str, ...], ...]  # what is written into each cell
    shades: np.ndarray  # (n, m): on the colour scale; NaN for a plain cell
    units: tuple[str, ...]  # of the blocks, upper ones first
    split: int  # rows and columns of the first block
    scale: ColourScale


Thing = TypeVar("Thing")
# Characters of a name and of any other text: longer ones leave no room for the picture.
_NAME, _TEXT = 64, 160
_NAMES = ("name", "label", "words", "groups")


def with_words(thing: Thing, escape: Callable[[str], str], longest: int = _TEXT) -> Thing:
    """A picture, or a part of one, with its texts escaped, and long ones without their middle.

    What a backend would take for a formula or for HTML, it takes for letters afterwards.
    """
    escaped: Any = thing
    if isinstance(thing, str):
        half = longest // 2
        shown = thing if len(thing) <= longest else f"{thing[: half - 1]}…{thing[-half:]}"
        escaped = escape(printable(shown, kept="\n"))
    elif isinstance(thing, tuple):
        escaped = tuple(with_words(item, escape, longest) for item in thing)
    elif is_dataclass(thing) and not isinstance(thing, type | Enum):
        part: Any = thing
        sizes = {f.name: _NAME if f.name in _NAMES else _TEXT for f in fields(part)}
        words = {n: with_words(getattr(part, n), escape, size) for n, size in sizes.items()}
        escaped = replace(part, **words)
    return escaped


Picture = Scene | Matrix | Bars | Field | Bands | Curves
