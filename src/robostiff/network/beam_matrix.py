"""Stiffness of a beam with two free ends, from that of its tip."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from robostiff.spatial import twist_transport


def beam_stiffness_12(
    tip_stiffness: Float[np.ndarray, "6 6"], length: float
) -> Float[np.ndarray, "12 12"]:
    """Stiffness of a free beam, ``B^T K B`` with ``B = [-J_v, I]``, v from start to end.

    ``B`` gives how far the end is from where the start would carry it as a rigid body; the wrench
    at the start follows by equilibrium. So rigid body motions meet no stiffness, exactly.

    Parameters
    ----------
    tip_stiffness : (6, 6) array
        K, of the end with the start clamped, in the beam's axes [N/m, N/rad, N m/rad].
    length : float
        Along the beam's x axis [m].

    Returns
    -------
    (12, 12) array
        Wrenches (start, end) for twists (start, end), each about its own end of the beam, in the
        beam's axes.

    Notes
    -----
    J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, section 5.6, prints
    the matrix entry by entry.

    Examples
    --------
    >>> K = beam_stiffness_12(np.diag([5.0, 0, 0, 0, 0, 0]), 2.0)
    >>> K[np.ix_([0, 6], [0, 6])]
    array([[ 5., -5.],
           [-5.,  5.]])
    """
    B = np.hstack([-twist_transport(np.array([length, 0.0, 0.0])), np.eye(6)])
    return B.T @ tip_stiffness @ B
