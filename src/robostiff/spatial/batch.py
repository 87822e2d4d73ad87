"""Memory order of batches: leading axes by name, trailing axes in memory.

All arrays are indexed ``(..., 6, 6)``. Elementwise work on many poses is three times faster when
equal entries of all poses lie side by side in memory; NumPy keeps that order through arithmetic, so
it is enough to establish it once.
"""

from __future__ import annotations

import numpy as np


def poses_side_by_side(a: np.ndarray, matrix_axes: int) -> np.ndarray:
    """The same array `(..., *matrix)`, with equal entries of all poses contiguous in memory.

    Parameters
    ----------
    a : (..., *matrix) array
    matrix_axes : int
        How many trailing axes belong to a pose (2 for matrices, 1 for vectors).

    Examples
    --------
    >>> poses_side_by_side(np.zeros((1000, 6, 6)), 2).strides
    (8, 48000, 8000)
    """
    batch_axes = a.ndim - matrix_axes
    if batch_axes == 0:
        return a
    order = (*range(batch_axes, a.ndim), *range(batch_axes))
    inverse = (*range(matrix_axes, a.ndim), *range(matrix_axes))
    return np.ascontiguousarray(a.transpose(order)).transpose(inverse)
