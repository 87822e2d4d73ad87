"""A matrix with its numbers, shades and units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.plot.picture.paint import ColourScale


@dataclass(frozen=True)
class QuarterUnit:
    """The unit of the numbers in a block of rows and columns, last ones excluded."""

    unit: str
    rows: tuple[int, int]
    columns: tuple[int, int]


@dataclass(frozen=True)
class Matrix:
    """A matrix to be read.

    Attributes
    ----------
    title : str
    rows, columns : tuple of str
        Names.
    texts : tuple of tuple of str
        What is written into each cell.
    shades : (n, m) array
        On the colour scale; NaN for a plain cell.
    units : tuple of QuarterUnit
        Upper blocks first.
    scale : ColourScale
    """

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    texts: tuple[tuple[str, ...], ...]
    shades: np.ndarray
    units: tuple[QuarterUnit, ...]
    scale: ColourScale
