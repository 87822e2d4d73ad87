"""Percentiles along a coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.plot.picture.field import Region
from robostiff.plot.picture.paint import Axis


@dataclass(frozen=True)
class Percentile:
    """Values below which a part of the poses lies: percent, and (n,) values with NaN for none."""

    percent: float
    values: np.ndarray


@dataclass(frozen=True)
class Bands:
    """Percentiles along a coordinate, and the share of poses that they are about.

    Attributes
    ----------
    title : str
    x : Axis
    label : str
        Of the values, with their unit.
    percentiles : tuple of Percentile
        Ascending, the median in the middle.
    left_out : tuple of Region
        ``where`` holds the share of poses, 0 to 1, that have no value for this reason.
    notes : tuple of str
    """

    title: str
    x: Axis
    label: str
    percentiles: tuple[Percentile, ...]
    left_out: tuple[Region, ...] = ()
    notes: tuple[str, ...] = ()
