"""Forms of K_C: the wrench basis form, which is the default, and those of the paper.

The block form (9), the recursive form (10) and (15), the saddle-point form (7), and the rules
(18)-(20) for joints along the frame axes.
"""

from __future__ import annotations

from itertools import chain
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.chain_problem import (
    COMPLIANT,
    INDEPENDENT,
    REGULAR,
    WELL_APART,
    ChainProblem,
    Form,
    Need,
)
from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial import Space
from robostiff.spatial.batch import Float


def wrench_basis_stiffness(
    C: Float[np.ndarray, "*batch n n"], W: Float[np.ndarray, "*batch n m"]
) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness K = W (W^T C W)^-1 W^T from the wrenches that the joints transmit.

    The dual of the recursion (15): beginning with no stiffness, each transmitted wrench w adds
    ``w w^T / (w^T C w)``, and the wrenches that remain are made conjugate to it. C is never
    inverted, and K is symmetric and positive semidefinite by construction.

    Parameters
    ----------
    C : (..., n, n) array
        Compliance of the chain with its passive joints held.
    W : (..., n, m) array
        Basis of the wrenches that the passive joints transmit; zero columns are passed over.

    Returns
    -------
    (..., n, n) array

    Examples
    --------
    Planar link of eq. (4) with a free joint at its tip:

    >>> C = np.array([[1.0, 0, 0], [0, 4.0, 6.0], [0, 6.0, 12.0]])
    >>> W = np.eye(3)[:, :2]
    >>> wrench_basis_stiffness(C, W)
    array([[1.  , 0.  , 0.  ],
           [0.  , 0.25, 0.  ],
           [0.  , 0.  , 0.  ]])
    """
    K = np.zeros(np.broadcast_shapes(C.shape, (*W.shape[:-2], 1, 1)))
    while W.shape[-1]:
        w, W = W[..., 0], W[..., 1:]
        Cw = np.einsum("...ij,...j->...i", C, w)
        mu = np.einsum("...i,...i->...", w, Cw)
        w_by_mu = w / np.where(mu > 0, mu, 1.0)[..., None]
        w_by_mu = np.where((mu > 0)[..., None], w_by_mu, 0.0)
        K = K + w[..., :, None] * w_by_mu[..., None, :]
        shared = np.einsum("...i,...im->...m", Cw, W)
        W = W - w_by_mu[..., :, None] * shared[..., None, :]
    return K


@frozen
class WrenchBasis(Form):
    """Form K = W (W^T C W)^-1 W^T: holds always, unless a direction is rigid."""

    name = "wrench-basis"
    equation = "K = W (W^T C W)^-1 W^T, W a basis of null(J_q^T)"

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        return wrench_basis_stiffness(problem.C, problem.W)

    def loses_digits(self, problem: ChainProblem, K: np.ndarray) -> np.ndarray:
        """Nowhere (...)."""
        return np.zeros(K.shape[:-2], dtype=bool)


def eliminate_block(
    K0: Float[np.ndarray, "*batch n n"], J_q: Float[np.ndarray, "*batch n q"]
) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness with passive joints, K = K0 - K0 J_q (J_q^T K0 J_q)^-1 J_q^T K0, eq. (9).

    Parameters
    ----------
    K0 : (..., n, n) array
        Stiffness without passive joints, (J_theta K_theta^-1 J_theta^T)^-1.
    J_q : (..., n, q) array
        Independent passive joint twists.

    Returns
    -------
    (..., n, n) array

    Raises
    ------
    numpy.linalg.LinAlgError
        When J_q^T K0 J_q is exactly singular.

    Examples
    --------
    >>> K0 = np.array([[2.0, 1.0], [1.0, 3.0]])
    >>> eliminate_block(K0, np.array([[0.0], [1.0]]))
    array([[1.66666667, 0.        ],
           [0.        , 0.        ]])
    """
    U = K0 @ J_q
    U_T = np.swapaxes(U, -1, -2)
    M = np.swapaxes(J_q, -1, -2) @ U
    return K0 - U @ np.linalg.solve(M, U_T)


_SINGULAR = 1e-15  # of the largest eigenvalue: none


def _is_singular(problem: ChainProblem) -> np.ndarray:
    """Whether J_q^T K0 J_q of independent joints is singular to rounding (...)."""
    if not problem.J_q.shape[-1]:
        return np.asarray(problem.dependent)
    values = np.linalg.eigvalsh(np.swapaxes(problem.J_q, -1, -2) @ problem.K0 @ problem.J_q)
    return np.asarray(~problem.dependent & (values[..., 0] <= _SINGULAR * values[..., -1]))


@frozen
class Block(Form):
    """Form (9): all passive joints at once. Needs rank(J_theta) = n and independent joints."""

    name = "block"
    equation = "(9) K = K0 - K0 J_q (J_q^T K0 J_q)^-1 J_q^T K0"
    needs: ClassVar[tuple[Need, ...]] = (
        REGULAR,
        INDEPENDENT,
        WELL_APART,
        Need(_is_singular, "the stiffness that its passive joints meet together is rounding"),
    )

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        K0, J_q = problem.K0, problem.J_q
        return eliminate_block(K0, J_q) if J_q.shape[-1] else K0


def eliminate_joint(
    K: Float[np.ndarray, "*batch n n"], J: Float[np.ndarray, "*batch n"]
) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness after one more passive joint, K - u u^T / mu, u = K J, mu = J^T u, eq. (15).

    Parameters
    ----------
    K : (..., n, n) array
        Stiffness before.
    J : (..., n) array
        Twist of the joint; it must meet stiffness (mu > 0).

    Returns
    -------
    (..., n, n) array

    Examples
    --------
    >>> eliminate_joint(np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([0.0, 1.0]))
    array([[1.66666667, 0.        ],
           [0.        , 0.        ]])
    """
    u = np.einsum("...ij,...j->...i", K, J)
    mu = np.einsum("...i,...i->...", J, u)
    return K - u[..., :, None] * (u / mu[..., None])[..., None, :]


@frozen
class Recursive(Form):
    """Form (10)/(15). Needs rank(J_theta) = n; redundant joints (mu = 0) are skipped.

    Attributes
    ----------
    groups : tuple of tuples of int, or None
        Order and grouping of the passive joints (columns of J_q, counted from 0), such as
        ``((2, 0), (1,))``; None for one by one in their order along the chain.
    """

    groups: tuple[tuple[int, ...], ...] | None = None

    name = "recursive"
    equation = "(15) K <- K - u u^T / mu, u = K J, mu = J^T u"
    needs: ClassVar[tuple[Need, ...]] = (REGULAR, WELL_APART)

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        K, joints = problem.K0, problem.J_q.shape[-1]
        groups = tuple((i,) for i in range(joints)) if self.groups is None else self.groups
        if sorted(chain.from_iterable(groups)) != list(range(joints)):
            expected = f"each of the {joints} joints 0 to {joints - 1} once"
            raise InputError("groups of passive joints", got=self.groups, expected=expected)
        for group in groups:
            # A redundant joint of a group is left out by giving it a unit pivot and no effect.
            kept = ~problem.redundant[..., group]
            J = np.where(kept[..., None, :], problem.J_q[..., group], 0.0)
            U = K @ J
            M = np.swapaxes(J, -1, -2) @ U
            M = M + np.where(kept, 0.0, 1.0)[..., None, :] * np.eye(len(group))
            K = K - U @ np.linalg.solve(M, np.swapaxes(U, -1, -2))
        return K


def saddle_point_matrix(
    C: Float[np.ndarray, "*batch n n"], J_q: Float[np.ndarray, "*batch n q"]
) -> Float[np.ndarray, "*batch p p"]:
    """Matrix [[C, J_q], [J_q^T, 0]] of eq. (7), C = J_theta K_theta^-1 J_theta^T.

    Examples
    --------
    >>> saddle_point_matrix(np.eye(2), np.array([[0.0], [1.0]]))
    array([[1., 0., 0.],
           [0., 1., 1.],
           [0., 1., 0.]])
    """
    n, q = J_q.shape[-2:]
    S = np.zeros((*J_q.shape[:-2], n + q, n + q))
    S[..., :n, :n] = C
    S[..., :n, n:] = J_q
    S[..., n:, :n] = np.swapaxes(J_q, -1, -2)
    return S


def saddle_point_stiffness(
    C: Float[np.ndarray, "*batch n n"], J_q: Float[np.ndarray, "*batch n q"]
) -> Float[np.ndarray, "*batch n n"]:
    """Upper-left block of [[C, J_q], [J_q^T, 0]]^-1, eq. (7).

    Parameters
    ----------
    C : (..., n, n) array
        Compliance with the passive joints held; it may be singular.
    J_q : (..., n, q) array
        Independent passive joint twists.

    Returns
    -------
    (..., n, n) array

    Examples
    --------
    >>> C = np.array([[1.0, 0, 0], [0, 4.0, 6.0], [0, 6.0, 12.0]])
    >>> saddle_point_stiffness(C, np.array([[0.0], [0.0], [1.0]])).round(12) + 0.0
    array([[1.  , 0.  , 0.  ],
           [0.  , 0.25, 0.  ],
           [0.  , 0.  , 0.  ]])
    """
    n, q = J_q.shape[-2:]
    return np.linalg.solve(saddle_point_matrix(C, J_q), np.eye(n + q, n))[..., :n, :]


@frozen
class SaddlePoint(Form):
    """Form (7). Needs independent joints and no rigid direction; C may be singular."""

    name = "saddle-point"
    equation = "(7) K = upper-left block of [[C, J_q], [J_q^T, 0]]^-1"
    needs: ClassVar[tuple[Need, ...]] = (INDEPENDENT, WELL_APART, COMPLIANT)

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        # Compliances near 1e-7 beside unit twists would cost digits: both are brought to size 1.
        trace = np.trace(problem.C, axis1=-2, axis2=-1)[..., None, None]
        size = np.where(trace > 0, trace, 1.0)
        return saddle_point_stiffness(problem.C / size, problem.J_q) / size

    def loses_digits(self, problem: ChainProblem, K: np.ndarray) -> np.ndarray:
        """Where K has fewer digits than asked for (...).

        Rounding of the sum C changes K by ``eps |C| |K|^2``, above all in its smaller block.
        """
        return problem.costs_digits(K, K, problem.compliance_ratio)


NOT_ALONG_AXES = (
    "index rules hold for joints along the frame axes only (trivial or quasi-trivial columns, "
    "eq. (18)-(19)), and a joint is oblique"
)
_ZERO = 1e-12  # of a unit twist: what is left of a zero after a rotation matrix


def eliminate_index(K: Float[np.ndarray, "*batch n n"], p: int) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness after a trivial joint along coordinate p, K_jk - K_jp K_pk / K_pp, eq. (19).

    Row and column p of the result vanish, eq. (20). (The paper prints ``K_jk K_kj`` in (19) and
    "for all p" in (20); the rule is as here, for all k.)

    Parameters
    ----------
    K : (..., n, n) array
    p : int
        Coordinate of the joint, counted from 0.

    Examples
    --------
    >>> eliminate_index(np.array([[2.0, 1.0], [1.0, 3.0]]), 1)
    array([[1.66666667, 0.        ],
           [0.        , 0.        ]])
    """
    size = K.shape[-1]
    if not 0 <= p < size:
        raise InputError("coordinate of a trivial joint", got=p, expected=f"0 to {size - 1}")
    reduced = K - K[..., :, p, None] * (K[..., p, :] / K[..., p, p, None])[..., None, :]
    reduced[..., p, :] = 0
    reduced[..., :, p] = 0
    return reduced


def eliminate_quasi_trivial(
    K: Float[np.ndarray, "*batch n n"], p: int, d: Float[np.ndarray, "*batch t"]
) -> Float[np.ndarray, "*batch n n"]:
    """Stiffness after a quasi-trivial joint, column e_p + d of eq. (18), by entries of K alone.

    With u_j = K_jp + sum_i d_i K_ji and mu = u_p + sum_i d_i u_i, the entries become
    K_jk - u_j u_k / mu.

    Parameters
    ----------
    K : (..., n, n) array
    p : int
        Rotational coordinate of the joint, counted from 0.
    d : (..., 3) or (..., 2) array
        Translation of the reference point per turn, d = e x r [m].

    Examples
    --------
    >>> K = np.diag([1.0, 2.0, 4.0])
    >>> eliminate_quasi_trivial(K, 2, np.array([0.0, 1.0]))[1, 1].round(3)
    np.float64(1.333)
    """
    t = d.shape[-1]
    u = K[..., :, p] + np.einsum("...ji,...i->...j", K[..., :, :t], d)
    mu = u[..., p] + np.einsum("...i,...i->...", d, u[..., :t])
    return K - u[..., :, None] * (u / mu[..., None])[..., None, :]


def _along(J_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which displacements (..., t, q) and which turns (..., r, q) are not zero."""
    t = Space.of_size(J_q.shape[-2]).translations
    largest = np.max(np.abs(J_q), axis=-2, keepdims=True, initial=0.0)
    moving = np.abs(J_q) > _ZERO * largest
    return moving[..., :t, :], moving[..., t:, :]


def _has_oblique_joints(problem: ChainProblem) -> np.ndarray:
    """Whether a joint that is not redundant is not along a frame axis (...)."""
    moves, turns = _along(problem.J_q)
    along_axis = np.where(turns.any(axis=-2), turns.sum(axis=-2) == 1, moves.sum(axis=-2) == 1)
    return np.asarray(np.any(~along_axis & ~problem.redundant, axis=-1))


@frozen
class IndexRules(Form):
    """Rules (18)-(20): needs rank(J_theta) = n and every joint along a frame axis.

    A joint is trivial when it is prismatic along, or revolute at the reference point about, a frame
    axis; quasi-trivial when it is revolute about a frame axis elsewhere.
    """

    name = "index-rules"
    equation = "(19) K_jk <- K_jk - K_jp K_pk / K_pp"
    needs: ClassVar[tuple[Need, ...]] = (
        REGULAR,
        Need(_has_oblique_joints, NOT_ALONG_AXES),
        WELL_APART,
    )

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        J_q = problem.J_q
        t = Space.of_size(J_q.shape[-2]).translations
        moves, turns = _along(J_q)
        K = problem.K0.copy()
        for i in range(J_q.shape[-1]):
            # Poses may differ in the axis of a joint: each coordinate in turn takes its own.
            for p in range(J_q.shape[-2]):
                fits = turns[..., p - t, i] if p >= t else moves[..., p, i] & ~turns[..., i].any(-1)
                fits = fits & ~problem.redundant[..., i]
                # (19), or (18) where the axis is shifted.
                trivial = fits & ~moves[..., i].any(axis=-1) if p >= t else fits
                if np.any(trivial):
                    K[trivial] = eliminate_index(K[trivial], p)
                quasi = fits & ~trivial
                if np.any(quasi):
                    J = J_q[..., i][quasi]
                    K[quasi] = eliminate_quasi_trivial(K[quasi], p, J[..., :t] / J[..., p, None])
        return K
