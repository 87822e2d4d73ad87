"""Null spaces of geometry, with the doubt that remains, and coordinates that pin them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from robostiff.elastostatics import Tolerance


@dataclass(frozen=True)
class NullSpaces:
    """Null spaces of a matrix of unit wrenches.

    Attributes
    ----------
    right : (columns, k) array
        Orthonormal motions that no wrench resists.
    left : (rows, l) array
        Orthonormal wrenches in equilibrium with themselves.
    doubtful : bool
        Whether a singular value is neither clearly zero nor clearly not.
    """

    right: np.ndarray
    left: np.ndarray
    doubtful: bool


def null_spaces(G: np.ndarray, tolerance: Tolerance) -> NullSpaces:
    """Null spaces of a matrix whose rows are unit wrenches on bodies.

    Singular values below `Tolerance.independence` are zero.

    Examples
    --------
    >>> spaces = null_spaces(np.array([[1.0, -1.0]]), Tolerance())
    >>> spaces.right.shape, spaces.left.shape
    ((2, 1), (1, 0))
    """
    rows, columns = G.shape
    if rows == 0 or columns == 0:
        return NullSpaces(np.eye(columns), np.eye(rows), False)
    U, values, Vt = np.linalg.svd(G)
    rank = int(np.count_nonzero(values > tolerance.independence))
    between = (values > tolerance.rounding) & (values <= tolerance.near_independence)
    return NullSpaces(Vt[rank:].T, U[:, rank:], bool(np.any(between)))


def pinning_coordinates(basis: np.ndarray) -> np.ndarray:
    """Coordinates (k,) whose loss leaves nothing of a space (size, k): pivoted QR.

    Examples
    --------
    >>> pinning_coordinates(np.array([[0.1], [0.9], [0.2]]))
    array([1])
    """
    k = basis.shape[1]
    if k == 0:
        return np.zeros(0, dtype=int)
    *_, pivots = qr(basis.T, mode="r", pivoting=True)
    return np.array(pivots[:k], dtype=int)
