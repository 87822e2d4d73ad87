"""Values over a plane, and what stands where there are none."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from robostiff.plot.picture.paint import Axis, ColourScale


class Cover(Enum):
    """Whether a region has values to be seen."""

    INSTEAD = "instead of values"
    OVER = "hatched over values"


@dataclass(frozen=True)
class Region:
    """Poses of which something is to be said.

    Attributes
    ----------
    name : str
    where : array of bool
        Of the shape of the values.
    cover : Cover
    order : int
        Its own colour and hatching, the same in all pictures.
    """

    name: str
    where: np.ndarray
    cover: Cover
    order: int


@dataclass(frozen=True)
class Field:
    """Values over a plane.

    Attributes
    ----------
    title : str
    x, y : Axis
    values : (y, x) array
        NaN where a region stands instead.
    scale : ColourScale
    regions : tuple of Region
    isolines : tuple of float
        Values along which lines are drawn.
    notes : tuple of str
    """

    title: str
    x: Axis
    y: Axis
    values: np.ndarray
    scale: ColourScale
    regions: tuple[Region, ...] = ()
    isolines: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
