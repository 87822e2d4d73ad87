"""The block form, eq. (9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.chain_problem import (
    INDEPENDENT,
    REGULAR,
    WELL_APART,
    ChainProblem,
    Form,
    Need,
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
class Block(Form):
    """Form (9): all passive joints at once. Needs rank(J_theta) = n and independent joints."""

    name = "block"
    equation = "(9) K = K0 - K0 J_q (J_q^T K0 J_q)^-1 J_q^T K0"
    needs: ClassVar[tuple[Need, ...]] = (REGULAR, INDEPENDENT, WELL_APART)

    def stiffness(self, problem: ChainProblem) -> np.ndarray:
        """K of a scaled chain."""
        K0, J_q = problem.K0, problem.J_q
        return eliminate_block(K0, J_q) if J_q.shape[-1] else K0
