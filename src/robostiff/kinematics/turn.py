"""Rotations about fixed axes by many angles at once, or by one recorded entry."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Shaped
from scipy.spatial.transform import Rotation

from robostiff.kinematics.turn_of_entries import Turn, turn_by_vector_of_entries
from robostiff.spatial import skew
from robostiff.spatial.batch import poses_side_by_side


def turn_about(
    axis: Shaped[np.ndarray, 3], angle: Shaped[np.ndarray, "*batch"]
) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Rotation matrix I + sin(a) (e x) + (1 - cos(a)) (e x)^2 about a fixed axis.

    Parameters
    ----------
    axis : (3,) array
        Unit vector e.
    angle : (...) array
        Angle a [rad]; one, without batch axes, where it or the axis has recorded entries.

    Returns
    -------
    (..., 3, 3) array

    Examples
    --------
    >>> turn_about(np.array([0.0, 0.0, 1.0]), np.array(np.pi / 2)).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    if object in (angle.dtype, axis.dtype):
        return Turn.by(angle.item()).about(axis)
    E = skew(axis)
    entries = (3, 3, *(1,) * angle.ndim)
    sine, versine = np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2
    R = np.eye(3).reshape(entries) + sine * E.reshape(entries) + versine * (E @ E).reshape(entries)
    return np.moveaxis(R, (0, 1), (-2, -1))


def turn_by_vector(r: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Rotation matrix of rotation vectors [rad].

    Examples
    --------
    >>> turn_by_vector(np.zeros(3)).trace()
    np.float64(3.0)
    """
    if r.dtype == object:
        return turn_by_vector_of_entries(r)
    # A copy: SciPy takes no read-only arrays.
    R = Rotation.from_rotvec(np.array(r, dtype=float).reshape(-1, 3)).as_matrix()
    return poses_side_by_side(R.reshape(*r.shape, 3), 2)


def vector_of_turn(R: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 3"]:
    """Rotation vectors [rad] of rotation matrices, angles up to pi.

    Examples
    --------
    >>> vector_of_turn(turn_by_vector(np.array([0.1, 0.2, 0.3])))
    array([0.1, 0.2, 0.3])
    """
    matrices = np.array(R, dtype=float).reshape(-1, 3, 3)
    r = Rotation.from_matrix(matrices, assume_valid=True).as_rotvec()
    return poses_side_by_side(r.reshape(R.shape[:-1]), 1)


def rotvec_rate(r: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Matrix that turns the rate of a rotation vector into angular velocity, w = J_l(r) dr/dt.

    J_l = I + (1 - cos a)/a^2 (r x) + (a - sin a)/a^3 (r x)^2, a = |r|.

    Examples
    --------
    >>> rotvec_rate(np.zeros(3))
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    X = skew(r)
    a = np.linalg.norm(r, axis=-1)[..., None, None]
    small = a < 1e-4
    safe = np.where(small, 1.0, a)
    first = np.where(small, 0.5 - a**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - a**2 / 120, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) + first * X + second * (X @ X)
