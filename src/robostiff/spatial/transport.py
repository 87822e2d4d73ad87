"""Other axes, eq. (11), and another reference point, eq. (12)-(14), of wrenches and matrices.

Everywhere ``v`` points from the old reference point to the new one, in the axes of the matrices.
The paper prints both signs of (13) reversed; with v from the leg end to the reference point, as it
defines it, ``J_v = [[I, -(v x)], [0, I]]``.
"""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.spatial.batch import Shaped, empty_batch
from robostiff.spatial.quantities import refuse_quantities


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


def twist_transport(v: Shaped[np.ndarray, "*batch d"]) -> Shaped[np.ndarray, "*batch n n"]:
    """Matrix J_v of eq. (13), sign corrected: t_new = J_v t_old with J_v = [[I, -(v x)], [0, I]].

    Parameters
    ----------
    v : (..., 3) or (..., 2) array
        Vector from the old reference point to the new one [m]; of length 2 in the plane.

    Returns
    -------
    (..., 6, 6) or (..., 3, 3) array

    Raises
    ------
    InputError
        When `v` has neither 3 nor 2 components.

    Examples
    --------
    A turn about z moves a point at x = 2 m along y:

    >>> twist_transport(np.array([2.0, 0.0, 0.0])) @ np.array([0, 0, 0, 0, 0, 0.1])
    array([0. , 0.2, 0. , 0. , 0. , 0.1])
    >>> twist_transport(np.array([2.0, 0.0])) @ np.array([0, 0, 0.1])
    array([0. , 0.2, 0.1])
    """
    if not isinstance(v, np.ndarray):  # NumPy would drop the unit of a quantity
        refuse_quantities("vector between reference points", v, "numbers [m]")
        v = np.asarray(v, dtype=float)
    if v.shape[-1] == 3:
        J = np.zeros((*v.shape[:-1], 6, 6), dtype=v.dtype)
        J.reshape(*v.shape[:-1], 36)[..., ::7] = 1  # the diagonal
        J[..., :3, 3:] = -skew(v)
        return J
    if v.shape[-1] == 2:
        J = np.zeros((*v.shape[:-1], 3, 3), dtype=v.dtype)
        J[..., range(3), range(3)] = 1
        J[..., 0, 2] = -v[..., 1]
        J[..., 1, 2] = v[..., 0]
        return J
    raise InputError("vector between reference points", got=v.shape, expected="2 or 3 components")


def move_twist(
    t: Shaped[np.ndarray, "*#batch n"], v: Shaped[np.ndarray, "*#batch d"]
) -> Shaped[np.ndarray, "*batch n"]:
    """Twist at the new reference point, t_new = J_v t_old.

    Examples
    --------
    >>> move_twist(np.array([0, 0, 0, 0, 0, 0.1]), np.array([2.0, 0.0, 0.0]))
    array([0. , 0.2, 0. , 0. , 0. , 0.1])
    """
    return np.einsum("...ij,...j->...i", twist_transport(v), t)


def move_wrench(
    F: Shaped[np.ndarray, "*#batch n"], v: Shaped[np.ndarray, "*#batch d"]
) -> Shaped[np.ndarray, "*batch n"]:
    """Wrench about the new reference point, F_new = J_v^-T F_old (the moment changes by -v x F).

    Examples
    --------
    >>> move_wrench(np.array([0, 10.0, 0, 0, 0, 0]), np.array([2.0, 0.0, 0.0]))
    array([  0.,  10.,   0.,   0.,   0., -20.])
    """
    return np.einsum("...ji,...j->...i", twist_transport(np.negative(v)), F)


def move_stiffness(
    K: Shaped[np.ndarray, "*#batch n n"], v: Shaped[np.ndarray, "*#batch d"]
) -> Shaped[np.ndarray, "*batch n n"]:
    """Stiffness about the new reference point, K_new = J_v^-T K_old J_v^-1, the terms of eq. (12).

    Parameters
    ----------
    K : (..., n, n) array
        Stiffness about the old reference point.
    v : (..., 3) or (..., 2) array
        Vector from the old reference point to the new one [m].

    Returns
    -------
    (..., n, n) array

    Examples
    --------
    >>> spring = np.diag([0.0, 100.0, 0.0, 0.0, 0.0, 0.0])
    >>> float(move_stiffness(spring, np.array([2.0, 0.0, 0.0]))[5, 5])
    400.0
    """
    J_inverse = twist_transport(np.negative(v))
    return np.swapaxes(J_inverse, -1, -2) @ K @ J_inverse


def move_compliance(
    C: Shaped[np.ndarray, "*#batch n n"], v: Shaped[np.ndarray, "*#batch d"]
) -> Shaped[np.ndarray, "*batch n n"]:
    """Compliance of the new reference point, C_new = J_v C_old J_v^T.

    Examples
    --------
    >>> hinge_spring = np.diag([0, 0, 0, 0, 0, 0.01])
    >>> float(move_compliance(hinge_spring, np.array([2.0, 0.0, 0.0]))[1, 1])
    0.04
    """
    J = twist_transport(v)
    return J @ C @ np.swapaxes(J, -1, -2)


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


def level_axes(R: Shaped[np.ndarray, "*batch 3 3"]) -> Shaped[np.ndarray, "*batch 3 3"]:
    """Axes x and y in the x-y plane, x along one of the local axes that lie flattest, and z.

    A part that bends in the plane has its stiff directions along them: turned to the world, these
    would lose to soft ones as many digits as lie between them.

    Parameters
    ----------
    R : (..., 3, 3) array
        Rotation whose columns are the local axes in global coordinates.

    Returns
    -------
    (..., 3, 3) array
        Rotation whose columns are these axes in global coordinates.

    Examples
    --------
    >>> level_axes(np.array([[0.6, 0.0, -0.8], [0.8, 0.0, 0.6], [0.0, -1.0, 0.0]]))
    array([[ 0.6, -0.8,  0. ],
           [ 0.8,  0.6,  0. ],
           [ 0. ,  0. ,  1. ]])
    """
    flattest = np.argmin(np.abs(R[..., 2:, :]), axis=-1)[..., None]
    x, y = np.moveaxis(np.take_along_axis(R, flattest, axis=-1)[..., :2, 0], -1, 0)
    level, size = np.zeros(R.shape), np.hypot(x, y)
    level[..., 0, 0] = level[..., 1, 1] = x / size
    level[..., 1, 0], level[..., 0, 1], level[..., 2, 2] = y / size, -y / size, 1
    return level


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
