"""Index rules for joints along the frame axes, eq. (18)-(20)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.chain_problem import REGULAR, WELL_APART, ChainProblem, Form, Need
from robostiff.errors import InputError
from robostiff.spatial import Space
from robostiff.spatial.shapes import Float

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
    return np.any(~along_axis & ~problem.redundant, axis=-1)


@dataclass(frozen=True)
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
                own = turns[..., p - t, i] if p >= t else moves[..., p, i] & ~turns[..., i].any(-1)
                own = own & ~problem.redundant[..., i]
                # (19), or (18) where the axis is shifted.
                trivial = own & ~moves[..., i].any(axis=-1) if p >= t else own
                if np.any(trivial):
                    K[trivial] = eliminate_index(K[trivial], p)
                quasi = own & ~trivial
                if np.any(quasi):
                    J = J_q[..., i][quasi]
                    K[quasi] = eliminate_quasi_trivial(K[quasi], p, J[..., :t] / J[..., p, None])
        return K
