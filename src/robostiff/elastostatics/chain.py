"""Stiffness of a chain from its compliance and its passive joints, by any form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robostiff.elastostatics.chain_problem import ChainProblem, Form
from robostiff.elastostatics.forms import WrenchBasis
from robostiff.elastostatics.leg import unit_twists_and_wrenches
from robostiff.elastostatics.result import CartesianStiffness
from robostiff.elastostatics.status import Status
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE, Tolerance, matrix_length, scaling
from robostiff.errors import InputError
from robostiff.spatial import Space, as_floats

_DEFAULT_FORM = WrenchBasis()
_SYMMETRY = 1e-9


def chain_stiffness(
    C: ArrayLike,
    J_q: ArrayLike,
    *,
    form: Form = _DEFAULT_FORM,
    length: ArrayLike | None = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> CartesianStiffness:
    """Cartesian stiffness of a serial chain with passive joints, Sections III and V.

    Parameters
    ----------
    C : (..., n, n) array
        Compliance with the passive joints held, J_theta K_theta^-1 J_theta^T [m/N, 1/N,
        rad/(N m)]; n = 6 in space, 3 in the plane (x, y, rz).
    J_q : (..., n, q) array
        Twists of the passive joints about the same point; q = 0 for none.
    form : Form
        ``WrenchBasis()``, ``Block()``, ``Recursive()``, ``SaddlePoint()`` or ``IndexRules()``.
    length : float or (...) array, optional
        Characteristic length [m]; taken from the matrices when left out.
    tolerance : Tolerance

    Returns
    -------
    CartesianStiffness
        About the same point, in the same axes.

    Raises
    ------
    InputError
        When a shape does not fit, an entry is not finite, or C is not symmetric.

    Examples
    --------
    The planar link of eq. (4), free to turn at its tip:

    >>> C = [[1.0, 0, 0], [0, 4.0, 6.0], [0, 6.0, 12.0]]
    >>> result = chain_stiffness(C, [[0.0], [0.0], [1.0]])
    >>> result.K
    array([[1.  , 0.  , 0.  ],
           [0.  , 0.25, 0.  ],
           [0.  , 0.  , 0.  ]])
    >>> int(result.rank), str(result.status)
    (2, 'free-motions')
    """
    C, J_q = _checked(
        as_floats("compliance of the chain", C, "numbers (..., n, n)"),
        as_floats("passive joint Jacobian", J_q, "numbers (..., n, q), one column a joint"),
    )
    if length is None:
        return solve_chain(C, J_q, form, matrix_length(C, J_q), tolerance)
    L = as_floats("characteristic length", length, "positive metres", "m")
    if not np.all(L > 0) or (L.ndim and L.shape != C.shape[:-2]):
        raise InputError("characteristic length", got=length, expected="positive metres")
    return solve_chain(C, J_q, form, np.broadcast_to(L, C.shape[:-2]), tolerance)


def solve_chain(
    C: np.ndarray,
    J_q: np.ndarray,
    form: Form,
    length: np.ndarray,
    tolerance: Tolerance,
    present: np.ndarray | None = None,
) -> CartesianStiffness:
    """As `chain_stiffness`, for matrices that are known to fit and share their batch axes.

    `present` (..., q) marks the columns of J_q that exist: poses may differ in their number, and
    zero columns fill up.
    """
    space = Space.of_size(C.shape[-1])
    s = scaling(length, space)
    scale = s[..., :, None] * s[..., None, :]

    J_scaled, W, margins = unit_twists_and_wrenches(J_q * s[..., :, None], tolerance, present)
    redundant = margins <= tolerance.independence
    problem = ChainProblem(C * scale, J_scaled, W, redundant, margins, tolerance)

    if np.any(problem.compliance_ratio < -_SYMMETRY):
        expected = "a positive semidefinite matrix: a spring does not push where it is pulled"
        raise InputError("compliance of the chain", got=C, expected=expected)

    missing = [(need.missing(problem), need.reason) for need in form.needs]
    refused = np.logical_or.reduce([np.zeros(length.shape, dtype=bool), *(m for m, _ in missing)])
    allowed = problem.without(refused)
    K = np.zeros(C.shape) if np.all(refused) else form.stiffness(allowed)
    transmitted = np.count_nonzero(np.any(W != 0, axis=-2), axis=-1)
    doubtful = form.loses_digits(allowed, K) & ~refused
    K = 0.5 * (K + np.swapaxes(K, -1, -2)) * scale
    # Directions that joints free entirely keep no rounding.
    K = np.where((transmitted > 0)[..., None, None], K, 0.0)
    # Between rounding and the limit, a dropped joint may be independent.
    doubtful |= np.any(tolerance.leaves_in_doubt(margins), axis=-1)
    doubtful |= ~problem.rigid & (problem.compliance_ratio <= tolerance.near_rigidity)
    status = (
        (transmitted < space.size) * int(Status.FREE_MOTIONS)
        | problem.dependent * int(Status.REDUNDANT_JOINTS)
        | problem.rigid * int(Status.RIGID_DIRECTION)
        | doubtful * int(Status.ILL_CONDITIONED)
        | refused * int(Status.FORM_DOES_NOT_HOLD)
    )
    # Combinations of the transmitted wrenches that meet no compliance, zero columns elsewhere.
    rigid = np.zeros((*W.shape[:-1], 0))
    if np.any(problem.rigid):
        rigid, trace = np.zeros(W.shape), np.trace(problem.C, axis1=-2, axis2=-1)[..., None]
        values, modes = np.linalg.eigh(np.swapaxes(W, -1, -2) @ problem.C @ W)
        lost = values <= tolerance.rigidity * trace
        rigid[problem.rigid] = (W @ np.where(lost[..., None, :], modes, 0.0))[problem.rigid]
    return CartesianStiffness(
        matrix=np.broadcast_to(K, C.shape),
        status_codes=np.asarray(status, dtype=np.uint16),
        rank=np.asarray(transmitted),
        held=W,
        redundant=redundant,
        length=length,
        rigid=rigid,
        tolerance=tolerance,
        reason="; ".join(reason for where, reason in missing if np.any(where)),
    )


def _checked(C: np.ndarray, J_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if C.ndim < 2 or C.shape[-1] != C.shape[-2]:
        raise InputError("compliance of the chain", got=C.shape, expected="a shape (..., n, n)")
    Space.of_size(C.shape[-1])
    if J_q.ndim < 2 or J_q.shape[-2] != C.shape[-1]:
        expected = f"a shape (..., {C.shape[-1]}, q), one column a joint"
        hint = f"without passive joints write np.zeros(({C.shape[-1]}, 0))"
        raise InputError("passive joint Jacobian", got=J_q.shape, expected=expected, hint=hint)
    if np.any(np.einsum("...ii->...i", C) < 0):
        subject = "compliance of the chain"
        raise InputError(subject, got=C, expected="no negative entry on the diagonal")
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", C), 0.0))
    allowed = _SYMMETRY * size[..., :, None] * size[..., None, :]
    skewness = np.abs(C - np.swapaxes(C, -1, -2))
    if np.any(skewness > allowed):
        *pose, i, j = (int(k) for k in np.argwhere(skewness > allowed)[0])
        raise InputError(
            f"compliance of the chain, entries [{i}, {j}] and [{j}, {i}]",
            got=(float(C[*pose, i, j]), float(C[*pose, j, i])),
            expected="a symmetric matrix",
        )
    batch = np.broadcast_shapes(C.shape[:-2], J_q.shape[:-2])
    return (
        np.broadcast_to(C, (*batch, *C.shape[-2:])),
        np.broadcast_to(J_q, (*batch, *J_q.shape[-2:])),
    )
