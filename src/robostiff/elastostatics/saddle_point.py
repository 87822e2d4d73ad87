"""The saddle-point form, eq. (7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.chain_problem import (
    COMPLIANT,
    INDEPENDENT,
    WELL_APART,
    ChainProblem,
    Form,
    Need,
)
from robostiff.spatial.shapes import Float


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


@dataclass(frozen=True)
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
        """Where K has fewer digits than asked for (...)."""
        return np.asarray(problem.costs_digits(K))
