"""Rotating stiffness and compliance from local to global axes, eq. (11)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Shaped


def block_rotation(R: Shaped[np.ndarray, "*batch 3 3"]) -> Shaped[np.ndarray, "*batch 6 6"]:
    """Matrix diag(R, R), which turns twists and wrenches alike.

    Parameters
    ----------
    R : (..., 3, 3) array
        Rotation whose columns are the local axes in global coordinates.

    Returns
    -------
    (..., 6, 6) array

    Examples
    --------
    >>> quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    >>> block_rotation(quarter_turn) @ np.array([1.0, 0, 0, 0, 1.0, 0])
    array([ 0.,  1.,  0., -1.,  0.,  0.])
    """
    block = np.zeros((*R.shape[:-2], 6, 6), dtype=R.dtype)
    block[..., :3, :3] = R
    block[..., 3:, 3:] = R
    return block


def rotate_stiffness(
    K_local: Shaped[np.ndarray, "*#batch 6 6"], R: Shaped[np.ndarray, "*#batch 3 3"]
) -> Shaped[np.ndarray, "*batch 6 6"]:
    """Stiffness or compliance in global axes, K_glob = diag(R, R) K_loc diag(R, R)^T, eq. (11).

    Parameters
    ----------
    K_local : (..., 6, 6) array
        Stiffness (or compliance: the rule is the same) in local axes.
    R : (..., 3, 3) array
        Rotation whose columns are the local axes in global coordinates.

    Returns
    -------
    (..., 6, 6) array
        The matrix about the same point, in global axes.

    Examples
    --------
    >>> quarter_turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    >>> np.diag(rotate_stiffness(np.diag([1.0, 2, 3, 4, 5, 6]), quarter_turn))
    array([2., 1., 3., 5., 4., 6.])
    """
    block = block_rotation(R)
    return block @ K_local @ np.swapaxes(block, -1, -2)
