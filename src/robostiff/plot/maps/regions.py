"""What a map says of poses besides their values: out of reach, free, doubtful."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robostiff.analysis.maps.variables import status_flags
from robostiff.plot.picture import Cover, Region

if TYPE_CHECKING:
    import xarray

RANK_DEFICIENT = "rank-deficient"
NO_VALUE = "no value"
# The first that holds names the pose.
_INSTEAD = (
    "not-computed",
    "excluded",
    "unreachable",
    "rigid-direction",
    "form-does-not-hold",
    "unbalanced",
)
_OVER = ("ill-conditioned", "beyond-limits")
_NAMES = (*_INSTEAD, RANK_DEFICIENT, NO_VALUE, *_OVER)


def regions(found: xarray.Dataset, values: np.ndarray, full_rank: int) -> tuple[Region, ...]:
    """Regions of a map or of a part of it.

    Every pose has a value to be shown or lies in one region instead: out of reach, rank-deficient
    whatever its value, and so on. Poses that are ill-conditioned or beyond limits keep their value,
    and lie in a region over it.

    Parameters
    ----------
    found : Dataset
        With the variables ``rank`` and ``status``.
    values : array
        Of the quantity, of the shape of ``status``.
    full_rank : int
        A pose with less is rank-deficient.
    """
    status, rank = found["status"].values, found["rank"].values
    flags = {name: flag for flag, name in status_flags().items()}
    told = np.zeros(status.shape, dtype=bool)
    parts = []

    def add(name: str, where: np.ndarray, cover: Cover) -> None:
        if np.any(where):
            parts.append(Region(name, where, cover, _NAMES.index(name)))

    for name in _INSTEAD:
        where = ((status & flags[name]) != 0) & ~told
        add(name, where, Cover.INSTEAD)
        told |= where
    deficient = (rank < full_rank) & ~told
    add(RANK_DEFICIENT, deficient, Cover.INSTEAD)
    told |= deficient
    add(NO_VALUE, ~np.isfinite(values) & ~told, Cover.INSTEAD)
    told |= ~np.isfinite(values)
    for name in _OVER:
        add(name, ((status & flags[name]) != 0) & ~told, Cover.OVER)
    return tuple(parts)


def shown_values(values: np.ndarray, parts: tuple[Region, ...]) -> np.ndarray:
    """Values with NaN where a region stands instead."""
    hidden = np.zeros(values.shape, dtype=bool)
    for region in parts:
        if region.cover is Cover.INSTEAD:
            hidden |= region.where
    return np.where(hidden, np.nan, values)
