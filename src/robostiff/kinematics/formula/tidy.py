"""Exact zeros and ones in place of rounded ones, so that they leave no trace in a record."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.record import Entry
from robostiff.record.entry import is_exact

#: Of a cosine: what a few operations leave of an exact zero.
ROUNDING = 4e-15


def tidied(values: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """The same entries, those that are 0 or +-1 but for rounding as integers.

    Parameters
    ----------
    values : array of entries or numbers
    scale : float
        Size against which a number counts as zero.

    Returns
    -------
    array of objects

    Examples
    --------
    >>> tidied(np.array([6e-17, 1.0, 0.5]))
    array([0, 1, 0.5], dtype=object)
    """
    out = np.empty(values.shape, dtype=object)
    for place in np.ndindex(values.shape):
        out[place] = _tidy(values[place], scale)
    return out


def tidied_point(p: np.ndarray) -> np.ndarray:
    """The same point; components of the size of rounding beside the largest become 0.

    Examples
    --------
    >>> tidied_point(np.array([0.3, 2e-17, 0.0]))
    array([0.3, 0, 0], dtype=object)
    """
    return tidied(p, max(size_of(x) for x in p))


def size_of(value: Any) -> float:
    """Largest size of an entry at the samples, or the size of a number."""
    return float(np.max(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def _tidy(value: Any, scale: float) -> Any:
    if isinstance(value, Entry):
        return value.record.settled(value, scale)
    if is_exact(value):
        return value
    if abs(value) <= ROUNDING * scale:
        return 0
    for unit in (1, -1):
        if abs(value - unit) <= ROUNDING:
            return unit
    return float(value)
