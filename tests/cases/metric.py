"""How far apart two stiffness matrices are."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.elastostatics import matrix_distance


def distance(
    K: np.ndarray,
    K_ref: np.ndarray,
    length: float = 1.0,
    least: float = 0.0,
    sizes_of: np.ndarray | None = None,
) -> float:
    """`matrix_distance` of a robot of a metre, in which every block counts however small it is.

    In units of the blocks of the second matrix, or of another one.

    Examples
    --------
    >>> round(distance(np.diag([1.0, 1, 1, 4, 4, 4.4]), np.diag([1.0, 1, 1, 4, 4, 4])), 12)
    0.1
    """
    if sizes_of is not None:
        K, K_ref = sizes_of + (K - K_ref), sizes_of
    return matrix_distance(K, K_ref, length, least)


def apart(found: Any, expected: Any) -> float:
    """The largest difference of two arrays, in units of the largest number of the second."""
    return float(np.max(np.abs(np.asarray(found) - expected)) / np.max(np.abs(expected)))
