"""The block form, eq. (9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics.chain_problem import (
    C_SINGULAR,
    J_DEPENDENT,
    J_NEARLY_DEPENDENT,
    ChainProblem,
    FormAnswer,
    refusal,
)
from robostiff.spatial.shapes import Float


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


@dataclass(frozen=True)
class Block:
    """Form (9): all passive joints at once. Needs rank(J_theta) = n and independent joints."""

    name = "block"
    equation = "(9) K = K0 - K0 J_q (J_q^T K0 J_q)^-1 J_q^T K0"

    def solve(self, problem: ChainProblem) -> FormAnswer:
        """Stiffness of a scaled chain."""
        refused, reason = refusal(
            (~problem.regular, C_SINGULAR),
            (problem.dependent, J_DEPENDENT),
            (problem.nearly_dependent, J_NEARLY_DEPENDENT),
        )
        n, q = problem.J_q.shape[-2:]
        if q == 0:
            K = problem.K0
            return FormAnswer(K, refused, reason, problem.costs_digits_to_invert(K))
        if np.all(refused):
            return FormAnswer(np.zeros_like(problem.C), refused, reason)
        # A refused pose must not stop the others.
        K0 = np.where(refused[..., None, None], np.eye(n), problem.K0)
        J_q = np.where(refused[..., None, None], np.eye(n, q), problem.J_q)
        K = eliminate_block(K0, J_q)
        return FormAnswer(K, refused, reason, problem.costs_digits_to_invert(K))
