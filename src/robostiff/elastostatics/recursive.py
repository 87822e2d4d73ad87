"""The recursive form, eq. (10) and (15): one passive joint, or one group, after the other."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import ClassVar

import numpy as np

from robostiff.elastostatics.chain_problem import REGULAR, WELL_APART, ChainProblem, Form, Need
from robostiff.errors import InputError
from robostiff.spatial.shapes import Float


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


@dataclass(frozen=True)
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
        K = problem.K0
        for group in self._groups(problem.J_q.shape[-1]):
            # A redundant joint of a group is left out by giving it a unit pivot and no effect.
            kept = ~problem.redundant[..., group]
            J = np.where(kept[..., None, :], problem.J_q[..., group], 0.0)
            U = K @ J
            M = np.swapaxes(J, -1, -2) @ U
            M = M + np.where(kept, 0.0, 1.0)[..., None, :] * np.eye(len(group))
            K = K - U @ np.linalg.solve(M, np.swapaxes(U, -1, -2))
        return K

    def _groups(self, joints: int) -> tuple[tuple[int, ...], ...]:
        if self.groups is None:
            return tuple((i,) for i in range(joints))
        if sorted(chain.from_iterable(self.groups)) != list(range(joints)):
            raise InputError(
                "groups of passive joints",
                got=self.groups,
                expected=f"each of the {joints} joints 0 to {joints - 1} once",
            )
        return self.groups
