"""Rotation matrices and rotation vectors of arrays of floats."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.spatial.batch import empty_batch

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform
    from typing_extensions import TypeIs

_TINY = 1e-300  # keeps the quotient at the angle zero
_ORTHOGONAL = 1e-12  # by which R R^T may differ from the identity before R is corrected


def matrix_of_rotation(r: np.ndarray) -> np.ndarray:
    """Rotation matrices of rotation vectors through the quaternion (cos(a/2), sin(a/2) r/a).

    Parameters
    ----------
    r : (..., 3) array
        Rotation vectors [rad]; a = |r|.

    Returns
    -------
    (..., 3, 3) array

    Examples
    --------
    >>> matrix_of_rotation(np.array([0, 0, np.pi / 2])).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    a = np.sqrt(np.einsum("...i,...i->...", r, r) + _TINY)
    factor, c = np.sin(0.5 * a) / a, np.cos(0.5 * a)
    v = [r[..., i] * factor for i in range(3)]
    R = empty_batch(r.shape[:-1], (3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        R[..., i, i] = 1.0 - 2.0 * (v[j] * v[j] + v[k] * v[k])
        even, odd = v[i] * v[j], c * v[k]
        R[..., i, j], R[..., j, i] = 2.0 * (even - odd), 2.0 * (even + odd)
    return R


def vector_of_rotation(R: np.ndarray) -> np.ndarray:
    """Rotation vectors [rad] of rotation matrices, angles up to pi.

    The quaternion comes from its greatest entry, so that no digits are lost near half a turn.

    Parameters
    ----------
    R : (..., 3, 3) array

    Returns
    -------
    (..., 3) array

    Examples
    --------
    >>> vector_of_rotation(np.diag([-1.0, 1, -1]))
    array([0.        , 3.14159265, 0.        ])
    """
    trace = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2]
    squares = np.stack([R[..., 0, 0], R[..., 1, 1], R[..., 2, 2], trace], axis=-1)
    greatest = np.argmax(squares, axis=-1)
    # four times the quaternion (v, c), times the greatest of its entries
    q = empty_batch(trace.shape, (4,))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        q[..., i] = R[..., k, j] - R[..., j, k]
    q[..., 3] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        here = greatest == i
        if np.any(here):
            S = R[here]
            q[here, i] = 1.0 + S[:, i, i] - S[:, j, j] - S[:, k, k]
            q[here, j] = S[:, i, j] + S[:, j, i]
            q[here, k] = S[:, i, k] + S[:, k, i]
            q[here, 3] = S[:, k, j] - S[:, j, k]
    v, c = q[..., :3], q[..., 3]
    size = np.sqrt(np.einsum("...i,...i->...", v, v))
    half = np.arctan2(size, np.abs(c))
    turning = size > 0
    small = 2.0 / (np.abs(c) + _TINY)  # where the square of the size is below the range of floats
    factor = np.where(turning, 2.0 * half / np.where(turning, size, 1.0), small)
    return v * np.where(c < 0, -factor, factor)[..., None]


def nearest_rotation(R: np.ndarray) -> np.ndarray:
    """The rotation next to a matrix (3, 3), which is returned where it is one to 1e-12.

    Examples
    --------
    >>> nearest_rotation(np.diag([1.0, 1, 1 + 1e-7])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    if np.abs(R @ R.T - np.eye(3)).max() <= _ORTHOGONAL:
        return R
    U, _, V = np.linalg.svd(R)
    return U @ V


def is_rigid_transform(value: Any) -> TypeIs[RigidTransform]:
    """Whether a value is a rigid transform of SciPy, which none is before SciPy is imported.

    Examples
    --------
    >>> is_rigid_transform(np.eye(4))
    False
    """
    module = sys.modules.get("scipy.spatial.transform")
    return module is not None and isinstance(value, module.RigidTransform)
