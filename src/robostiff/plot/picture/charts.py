"""Charts as data: bars, bands, values over a plane, matrices; and the words in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from robostiff.errors import printable
from robostiff.plot.picture.scene import Category, ColourScale, Paint, PlotAxis, colour_of
from robostiff.plot.theme import Palette


@dataclass(frozen=True)
class Series:
    """One bar in every group."""

    name: str
    paint: Paint
    values: np.ndarray  # (groups,): NaN where there is no bar
    texts: tuple[str, ...] = ()  # written at each bar; empty for none


@dataclass(frozen=True)
class Group:
    """The name of a group of bars, and a note about it."""

    name: str
    note: str = ""


@dataclass(frozen=True)
class Panel:
    """Bars with one unit."""

    label: str  # of the axis of values, with its unit
    groups: tuple[Group, ...]
    series: tuple[Series, ...]


@dataclass(frozen=True)
class Bars:
    """Panels of bars."""

    title: str
    panels: tuple[Panel, ...]  # of the same series
    is_stacked: bool = False  # whether the bars of a group lie one after another
    notes: tuple[str, ...] = ()


class Cover(Enum):
    """Whether a region has visible values."""

    INSTEAD = "instead of values"
    OVER = "hatched over values"


# Looks of regions, by their order: a category of the palette, or a part of grey on the ground.
_TINTS = (None, None, None, 4, 5, 3, 2, 1, None, None, None)
_GREY = (0.35, 0.15, 0.55, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0)
_HATCHES = ("--", "..", "////", "//", "++", "||", "\\\\\\\\", "xxxx", "xx", "\\\\", "...")
_TINT = 0.38


@dataclass(frozen=True)
class RegionStyle:
    """Fill #rrggbb, none over values; hatching as Matplotlib writes it, and its colour."""

    fill: str | None
    hatch: str
    line: str


@dataclass(frozen=True)
class Region:
    """Poses that are marked, such as unreachable ones."""

    name: str
    where: np.ndarray  # of the shape of the values
    cover: Cover
    order: int = 0  # its own colour and hatching, the same in all pictures
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
        hatch = _HATCHES[self.order]
        if self.cover is Cover.OVER:
            return RegionStyle(None, hatch, palette.ground)
        tint = _TINTS[self.order]
        if tint is None:
            fill = palette.along((palette.ground, palette.faint), _GREY[self.order])
            return RegionStyle(fill, hatch, palette.muted)
        colour = palette.categories[tint]
        return RegionStyle(palette.along((palette.ground, colour), _TINT), hatch, colour)

    def key_style(self, palette: Palette) -> RegionStyle:
        """Its look where there are no values below it, as in a legend."""
        style = self.style(palette)
        return style if style.fill else replace(style, fill=palette.values[3])

    @property
    def reason(self) -> str:
        """Its name beside values, which some poses do not have."""
        has_none = self.cover is Cover.INSTEAD and self.paint is None
        return f"no value: {self.name}" if has_none else self.name


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Percentile:
    """Values below which a part of the poses lies: percent, and (n,) values with NaN for none."""

    percent: float
    values: np.ndarray


@dataclass(frozen=True)
class Bands:
    """Percentiles along a coordinate, and the shares of poses in regions."""

    title: str
    x: PlotAxis
    label: str  # of the values, with their unit
    # ascending, the median in the middle; none of ranks and statuses, which are shares alone
    percentiles: tuple[Percentile, ...]
    shares: tuple[Region, ...] = ()  # ``where`` holds the share of poses, 0 to 1
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Curve:
    """A curve."""

    name: str
    # (n,): NaN where it is interrupted
    x: np.ndarray
    y: np.ndarray
    paint: Category
    is_dashed: bool = False
    has_marks: bool = False


@dataclass(frozen=True)
class Curves:
    """Curves over common axes."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class QuarterUnit:
    """The unit of the numbers in a block of rows and columns, last ones excluded."""

    unit: str
    rows: tuple[int, int]
    columns: tuple[int, int]


@dataclass(frozen=True)
class Matrix:
    """A matrix with its numbers."""

    title: str
    rows: tuple[str, ...]  # names
    columns: tuple[str, ...]  # names
    texts: tuple[tuple[str, ...], ...]  # what is written into each cell
    shades: np.ndarray  # (n, m): on the colour scale; NaN for a plain cell
    units: tuple[QuarterUnit, ...]  # upper blocks first
    scale: ColourScale


Thing = TypeVar("Thing")
# Characters of a name and of any other text: longer ones leave no room for the picture.
_NAME, _TEXT = 64, 160
_NAMES = ("name", "label", "words")


def with_words(thing: Thing, escape: Callable[[str], str], longest: int = _TEXT) -> Thing:
    """A picture, or a part of one, with its texts escaped, and long ones without their middle.

    What a backend would take for a formula or for HTML, it takes for letters afterwards.
    """
    found: Any = thing
    if isinstance(thing, str):
        half = longest // 2
        shown = thing if len(thing) <= longest else f"{thing[: half - 1]}…{thing[-half:]}"
        found = escape(printable(shown, kept="\n"))
    elif isinstance(thing, tuple):
        found = tuple(with_words(item, escape, longest) for item in thing)
    elif is_dataclass(thing) and not isinstance(thing, type | Enum):
        own: Any = thing
        sizes = {f.name: _NAME if f.name in _NAMES else _TEXT for f in fields(own)}
        words = {n: with_words(getattr(own, n), escape, size) for n, size in sizes.items()}
        found = replace(own, **words)
    return found
