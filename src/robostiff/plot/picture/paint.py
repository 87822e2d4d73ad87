"""Meanings of colours; a theme maps them to colours."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from robostiff.plot.theme import Palette


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
    """Scale from values to colours.

    Attributes
    ----------
    label : str
        What the values are, with their unit.
    low, high : float
        Values at the ends.
    ticks : tuple of (float, str)
        Values named beside the scale; empty to leave the choice to the backend.
    """

    label: str
    low: float
    high: float
    ramp: Ramp = Ramp.VALUES
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
    """Name, unit and values of an axis.

    Attributes
    ----------
    label : str
        With its unit.
    """

    label: str
    values: np.ndarray
