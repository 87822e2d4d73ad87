"""Null spaces of unit wrenches, with a flag for doubtful ranks, and pinning coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from robostiff.elastostatics import Tolerance

if TYPE_CHECKING:
    from scipy.sparse import csc_array

# Parts of 1 that a matrix of unit wrenches is shifted by: inverse iteration is blind to them.
_FIRM, _FAINT = 1e-8, 1e-14
_ITERATIONS = 3
_FIRST_BLOCK = 16


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
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    return NullSpaces(Vt[rank:].T, U[:, rank:], doubtful)


def sparse_null_space(G: csc_array, tolerance: Tolerance) -> tuple[np.ndarray, bool]:
    """Orthonormal motions (columns, k) that no wrench resists, of a large sparse matrix.

    Inverse iteration with a block of vectors on ``[[-a I, G], [G^T, d I]]``, whose factors are as
    sparse as those of a network. The block grows until its weakest vector is held for certain; the
    singular values of G on the block then decide like those of G itself.

    Parameters
    ----------
    G : sparse (rows, columns) array
    tolerance : Tolerance

    Returns
    -------
    motions : (columns, k) array
    doubtful : bool
        Whether a singular value is neither clearly zero nor clearly not.

    Examples
    --------
    >>> from scipy.sparse import csc_array
    >>> motions, _ = sparse_null_space(csc_array(np.array([[1.0, -1.0, 0.0]])), Tolerance())
    >>> motions.shape
    (3, 2)
    """
    from scipy.sparse import block_array, eye_array
    from scipy.sparse.linalg import splu

    rows, columns = cast("tuple[int, int]", G.shape)
    lu = splu(
        block_array(
            [[-_FIRM * eye_array(rows), G], [G.T, _FAINT * eye_array(columns)]], format="csc"
        )
    )
    rng = np.random.default_rng(0)
    size = min(columns, _FIRST_BLOCK)
    while True:
        V = rng.normal(size=(columns, size))
        for _ in range(_ITERATIONS):
            right = np.vstack([np.zeros((rows, V.shape[1])), np.linalg.qr(V)[0]])
            V = lu.solve(right)[rows:]
        V = np.linalg.qr(V)[0]
        _, values, Wt = np.linalg.svd(G @ V, full_matrices=False)
        values = np.concatenate([values, np.zeros(size - len(values))])
        if size == columns or values[0] > tolerance.near_independence:
            break
        size = min(columns, 4 * size)
    lost = values <= tolerance.independence
    doubtful = bool(np.any(tolerance.leaves_in_doubt(values)))
    if len(Wt) < size:  # more motions than wrenches
        Wt = np.linalg.svd(G @ V)[2]
    return V @ Wt[lost].T, doubtful


def pinning_coordinates(basis: np.ndarray) -> np.ndarray:
    """Coordinates (k,) that are zero only for zero in a space (size, k): pivoted QR.

    Examples
    --------
    >>> pinning_coordinates(np.array([[0.1], [0.9], [0.2]]))
    array([1])
    """
    from scipy.linalg import qr

    k = basis.shape[1]
    if k == 0:
        return np.zeros(0, dtype=int)
    *_, pivots = qr(basis.T, mode="r", pivoting=True)
    return np.array(pivots[:k], dtype=int)
