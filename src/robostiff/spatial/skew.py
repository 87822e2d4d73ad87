"""Skew-symmetric matrix of a vector, eq. (14)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Shaped

from robostiff.spatial.batch import empty_batch


def skew(v: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Matrix (v x) with (v x) w = v x w, eq. (14).

    Parameters
    ----------
    v : (..., 3) array

    Returns
    -------
    (..., 3, 3) array

    Examples
    --------
    >>> skew(np.array([1.0, 2.0, 3.0]))
    array([[ 0., -3.,  2.],
           [ 3.,  0., -1.],
           [-2.,  1.,  0.]])
    """
    matrix = empty_batch(v.shape[:-1], (3, 3), v.dtype)
    for i in range(3):
        matrix[..., i, i] = 0
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix
