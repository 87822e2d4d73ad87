"""Singular postures of rigid linkages, where assembly modes meet: a parallelogram laid flat.

On a smooth path of configurations the closure ``G dx = 0`` of the whole robot, platform included,
keeps its rank. With U and V orthonormal bases of its rows and columns at one posture, the
determinant of ``U^T G V`` at the next has the same sign, unless a singular value has passed zero
between: there another family of configurations crosses the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.statics.equations.problem import EquilibriumProblem, Linearised

# Of the largest singular value of a closure: a direction that is missing all along; of the largest
# entry of a triangular factor: none is missing.
_LOST, _INDEPENDENT = 1e-9, 1e-6


@dataclass(frozen=True)
class Regular:
    """The closure of a robot at a posture: bases of its rows (c, k) and columns (n, k)."""

    U: np.ndarray
    V: np.ndarray
    sign: float  # of the determinant of U^T G V, and the logarithm of its size
    log: float

    @staticmethod
    def of(problem: EquilibriumProblem, known: Linearised) -> Regular:
        """At a posture that is not singular."""
        G = _closure(problem, known)
        V, R = np.linalg.qr(G.T)
        size = np.abs(np.diagonal(R))
        if len(size) == len(G) and np.all(size > _INDEPENDENT * np.max(size, initial=0.0)):
            U = np.eye(len(G))
        else:
            U, S, Vt = np.linalg.svd(G, full_matrices=False)
            k = int(np.count_nonzero(_LOST * np.max(S, initial=0.0) < S))
            U, V = U[:, :k], Vt[:k].T
        return Regular(U, V, *np.linalg.slogdet(U.T @ G @ V))

    def ratio(self, problem: EquilibriumProblem, known: Linearised) -> float:
        """Determinant of ``U^T G V`` at a posture near by: 1 here, 0 where it is singular."""
        sign, log = np.linalg.slogdet(self.U.T @ _closure(problem, known) @ self.V)
        return float(sign * self.sign * np.exp(log - self.log))


def may_be_singular(problem: EquilibriumProblem) -> bool:
    """Whether some leg has rigid loops, or no more coordinates than its closure has rows.

    An open leg of more coordinates keeps its rank, but by coincidence.
    """
    return any(
        lacking or len(group.chains) > 1 or (group.chains and group.free_size <= len(group.rows))
        for group, lacking in zip(problem.groups, problem.missing, strict=True)
    )


def _closure(problem: EquilibriumProblem, known: Linearised) -> np.ndarray:
    """G (c, n): of all legs by their coordinates and by the twist of the platform, as numbers."""
    L, r = problem.length, problem.size
    n = sum(group.count * group.free_size for group in problem.groups)
    blocks, at = [np.zeros((0, n + r))], 0
    parts = zip(problem.groups, problem.leg_sizes, known.equations, strict=True)
    for group, sizes, eq in parts:
        m, rows = group.free_size, group.closure_sizes(L)[:, None]
        for i in range(group.count):
            G = np.zeros((len(rows), n + r))
            G[:, at : at + m] = rows * eq.A[i, m:, :m] / sizes[i]
            G[:, n:] = rows * eq.A_t[i, m:] * L / problem.scale
            blocks.append(G)
            at += m
    return np.concatenate(blocks)
