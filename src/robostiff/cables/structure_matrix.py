"""The structure matrix: what wrench a unit of each cable's tension exerts on the platform."""

from __future__ import annotations

import numpy as np

from robostiff.cables.placement import PlacedCables
from robostiff.spatial import cross


def structure_matrix(placed: PlacedCables) -> np.ndarray:
    """Structure matrix A^T (..., n, m) [1, m], one column [u_i; b_i x u_i] a cable.

    The direction u_i points from the platform to the exit point, b_i from the reference point to
    the attachment. Equilibrium under an applied wrench F is ``A^T t + F = 0`` with tensions t, and
    the cables lengthen by ``-A x`` under a small twist x. (Pott 2018, chapter 3; there and in most
    of the literature t is called f and F is called w.)

    Parameters
    ----------
    placed : PlacedCables

    Examples
    --------
    >>> from robostiff.spatial import Space
    >>> placed = PlacedCables(np.array([[0, 0, 2.0]]), np.array([[1.0, 0, 2]]), np.zeros(3),
    ...     np.zeros(3), np.zeros(3), Space.SPATIAL)
    >>> structure_matrix(placed)[:, 0].tolist()
    [-1.0, 0.0, 0.0, 0.0, -2.0, 0.0]
    """
    u, b = -placed.directions, placed.arms
    columns = np.concatenate([u, cross(b, u)], axis=-1) + 0.0
    return np.swapaxes(columns[..., list(placed.space.rows)], -1, -2)


def weight_wrench(placed: PlacedCables) -> np.ndarray:
    """Wrench of the weight about the reference point (..., n) [N, N m], in world axes.

    Parameters
    ----------
    placed : PlacedCables
    """
    force = np.broadcast_to(placed.weight_force, placed.reference_point.shape)
    wrench = np.concatenate([force, cross(placed.weight_arm, force)], axis=-1)
    return wrench[..., list(placed.space.rows)]
