"""Blocks along the diagonal of a matrix, with batch axes before it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def block_diagonal(blocks: Sequence[np.ndarray]) -> np.ndarray:
    """Square blocks along the diagonal, zero elsewhere.

    Parameters
    ----------
    blocks : sequence of (..., k, k) arrays
        Of any sizes; their batch axes are broadcast.

    Returns
    -------
    (..., m, m) array

    Examples
    --------
    >>> block_diagonal([np.ones((1, 1)), 2 * np.ones((2, 2))])
    array([[1., 0., 0.],
           [0., 2., 2.],
           [0., 2., 2.]])
    """
    size = sum(block.shape[-1] for block in blocks)
    batch = np.broadcast_shapes(*(block.shape[:-2] for block in blocks))
    whole = np.zeros((*batch, size, size))
    start = 0
    for block in blocks:
        stop = start + block.shape[-1]
        whole[..., start:stop, start:stop] = block
        start = stop
    return whole
