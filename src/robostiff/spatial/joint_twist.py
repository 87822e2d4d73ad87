"""Column of the Jacobian that an elementary joint contributes, eq. (17)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def translation_twist(e: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 6"]:
    """Column of a prismatic joint, J_tran = [e; 0], eq. (17).

    Parameters
    ----------
    e : (..., 3) array
        Unit vector along the joint axis.

    Returns
    -------
    (..., 6) array

    Examples
    --------
    >>> translation_twist(np.array([0.0, 0.0, 1.0]))
    array([0., 0., 1., 0., 0., 0.])
    """
    return np.concatenate([e, np.zeros_like(e)], axis=-1)


def rotation_twist(
    e: Float[np.ndarray, "*batch 3"], r: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 6"]:
    """Column of a revolute joint, J_rot = [e x r; e], eq. (17) (its second column is misnamed there).

    Parameters
    ----------
    e : (..., 3) array
        Unit vector along the joint axis.
    r : (..., 3) array
        Vector from a point of the axis to the reference point [m].

    Returns
    -------
    (..., 6) array

    Examples
    --------
    >>> rotation_twist(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))
    array([0., 2., 0., 0., 0., 1.])
    """
    return np.concatenate([cross(e, r), e], axis=-1)


def cross(a: Float[np.ndarray, "*batch 3"], b: Float[np.ndarray, "*batch 3"]) -> np.ndarray:
    """Vector product over leading axes (np.cross costs four times as much on batches).

    Examples
    --------
    >>> cross(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    array([0., 0., 1.])
    """
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-1)
