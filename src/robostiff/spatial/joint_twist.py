"""Column of the Jacobian that an elementary joint contributes, eq. (17)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Shaped

from robostiff.spatial.batch import empty_batch, vector_of_entries


def translation_twist(e: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 6"]:
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
    twist = empty_batch(e.shape[:-1], (6,), e.dtype)
    twist[..., :3], twist[..., 3:] = e, 0
    return twist


def rotation_twist(
    e: Shaped[np.ndarray, "*#batch 3"], r: Shaped[np.ndarray, "*#batch 3"]
) -> Shaped[np.ndarray, "*batch 6"]:
    """Column of a revolute joint, J_rot = [e x r; e], eq. (17), where it is misnamed J_tran.

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
    batch = np.broadcast_shapes(e.shape, r.shape)[:-1]
    twist = empty_batch(batch, (6,), np.result_type(e, r))
    twist[..., :3], twist[..., 3:] = cross(e, r), e
    return twist


def cross(
    a: Shaped[np.ndarray, "*#batch 3"], b: Shaped[np.ndarray, "*#batch 3"]
) -> Shaped[np.ndarray, "*batch 3"]:
    """Vector product over leading axes (np.cross costs four times as much on batches).

    Examples
    --------
    >>> cross(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    array([0., 0., 1.])
    """
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    return vector_of_entries([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
