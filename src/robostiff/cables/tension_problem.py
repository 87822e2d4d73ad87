"""Tensions that balance a wrench within limits: the problem that the rules solve."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

_BALANCED = 1e-9


@dataclass(frozen=True)
class TensionProblem:
    """Find tensions t with A^T t + F = 0 and least <= t <= greatest, at N poses.

    Attributes
    ----------
    W : (N, n, m) array
        Structure matrix A^T, moments divided by a characteristic length.
    F : (N, n) array
        Wrench that the cables carry, scaled alike [N].
    least, greatest : (m,) arrays
        [N]; the greatest may be infinite.
    level : float
        Where between the two the tensions aim.
    """

    W: np.ndarray
    F: np.ndarray
    least: np.ndarray
    greatest: np.ndarray
    level: float

    @property
    def aim(self) -> np.ndarray:
        """Tensions of every cable (m,) that would be best [N]."""
        if self.level == 0:
            return self.least
        return self.least + self.level * (self.greatest - self.least)

    def part(self, poses: slice) -> TensionProblem:
        """The problem at some of the poses."""
        return replace(self, W=self.W[poses], F=self.F[poses])

    def missing(self, tensions: np.ndarray) -> np.ndarray:
        """Wrench (N, n) that the tensions leave to others, A^T t + F."""
        return np.einsum("nij,nj->ni", self.W, tensions) + self.F

    def balanced(self, tensions: np.ndarray) -> np.ndarray:
        """Whether the tensions balance the wrench (N,), to rounding."""
        size = np.abs(self.F).max(axis=-1) + np.abs(tensions).max(axis=-1)
        return np.asarray(np.abs(self.missing(tensions)).max(axis=-1) <= _BALANCED * size)

    def within(self, tensions: np.ndarray) -> np.ndarray:
        """Whether all tensions are within their limits (N,), to rounding."""
        slack = _BALANCED * (1.0 + np.abs(tensions))
        inside = (tensions >= self.least - slack) & (tensions <= self.greatest + slack)
        return np.asarray(inside.all(axis=-1))

    def has_solution(self, pose: int) -> bool:
        """Whether any tensions within the limits balance the wrench at a pose, by a linear program.

        The tension of every cable is told in parts of the largest force that occurs.
        """
        bounded = self.greatest[np.isfinite(self.greatest)]
        size = max(
            float(np.abs(self.F[pose]).max()), float(self.least.max()), *bounded.tolist(), 1e-300
        )
        bounds = [
            (low / size, high / size if np.isfinite(high) else None)
            for low, high in zip(self.least, self.greatest, strict=True)
        ]
        # Some rows may say the same: they are replaced by independent ones.
        U, values, _ = np.linalg.svd(self.W[pose])
        rank = int(np.count_nonzero(values > 1e-9))
        held, lost = U[:, :rank], U[:, rank:]
        if np.abs(lost.T @ self.F[pose]).max(initial=0.0) > _BALANCED * size:
            return False
        from scipy.optimize import linprog

        found = linprog(
            np.zeros(self.W.shape[-1]),
            A_eq=held.T @ self.W[pose],
            b_eq=-held.T @ self.F[pose] / size,
            bounds=bounds,
            method="highs",
        )
        return bool(found.status == 0)
