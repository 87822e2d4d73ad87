"""Directions and points as people say them."""

from __future__ import annotations

import numpy as np

_SMALL = 1e-7


def direction_in_words(direction: np.ndarray) -> str:
    """A direction, which is x, y or z where it is along that axis.

    Parameters
    ----------
    direction : (2,) or (3,) array
        Unit vector in world axes; of two components one in the x-y plane.

    Examples
    --------
    >>> direction_in_words(np.array([0.0, 0.0, -1.0])), direction_in_words(np.array([0.6, 0.8]))
    ('z', '(0.6, 0.8, 0)')
    """
    e = np.append(direction, np.zeros(3 - len(direction)))
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        if np.linalg.norm(np.cross(e, axis)) < _SMALL:
            return name
    return f"({numbers_in_words(e)})"


def numbers_in_words(values: np.ndarray) -> str:
    """Numbers of one unit in four digits; what is rounding beside the largest is 0.

    Parameters
    ----------
    values : (n,) array

    Examples
    --------
    >>> numbers_in_words(np.array([0.25, 1e-12, -1 / 3]))
    '0.25, 0, -0.3333'
    """
    scale = max(1e-3, float(np.max(np.abs(values))))
    return ", ".join(f"{0.0 if abs(v) < _SMALL * scale else v:.4g}" for v in values)
