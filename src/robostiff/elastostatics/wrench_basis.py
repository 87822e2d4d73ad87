"""The wrench basis form, K = W (W^T C W)^-1 W^T: the default."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.elastostatics.chain_problem import ChainProblem, Form
from robostiff.spatial.shapes import Float


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


@dataclass(frozen=True)
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
