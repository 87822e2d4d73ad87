"""Linear systems of mixed units: rows and columns equilibrated, answers refined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Of the largest singular value of an equilibrated system: below this a direction is lost.
LOST = 1e-11
# Condition of an equilibrated system beyond which lost directions are looked for.
_SINGULAR = 1e12


@dataclass(frozen=True)
class Equilibrated:
    """The inverse of square matrices (N, n, n); the least-squares inverse of singular ones.

    Attributes
    ----------
    A : (N, n, n) array
    rows, columns : (N, n) arrays
        Factors that bring the largest entry of each row and column near one.
    inverse : (N, n, n) array
        Of the scaled matrices.
    regular : (N,) array of bool
        Which of them have all directions.
    """

    A: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    inverse: np.ndarray
    regular: np.ndarray

    def solve(self, b: np.ndarray, refinements: int = 0) -> np.ndarray:
        """X (N, n, k) with ``A x = b``, refined so many times."""
        x = self._once(b)
        for _ in range(refinements):
            x = x + self._once(b - self.A @ x)
        return x

    def _once(self, b: np.ndarray) -> np.ndarray:
        return self.columns[..., None] * (self.inverse @ (self.rows[..., None] * b))


def equilibrated(A: np.ndarray) -> Equilibrated:
    """Invert square matrices (N, n, n) of mixed units.

    Examples
    --------
    >>> found = equilibrated(np.array([[[1e12, 1.0], [1.0, 1e-9]]]))
    >>> found.solve(np.array([[[1.0], [0.0]]]), 2)[0, 1, 0]
    np.float64(-0.001001...)
    """
    size = np.abs(A)
    rows, columns = np.ones(A.shape[:2]), np.ones(A.shape[:2])
    for _ in range(3):
        scaled = size * rows[:, :, None] * columns[:, None, :]
        rows = rows * _root(scaled.max(2, initial=0.0))
        columns = columns * _root(scaled.max(1, initial=0.0))
    scaled = A * rows[:, :, None] * columns[:, None, :]
    regular = np.ones(len(A), dtype=bool)
    try:
        inverse = np.linalg.inv(scaled)
        condition = _norm(scaled) * _norm(inverse)
        regular = condition < _SINGULAR
    except np.linalg.LinAlgError:
        inverse = np.zeros(A.shape)
        regular = np.zeros(len(A), dtype=bool)
    if not np.all(regular):
        for i in np.flatnonzero(~regular):
            inverse[i] = np.linalg.pinv(scaled[i], rcond=LOST)
            regular[i] = np.linalg.cond(scaled[i]) < 1.0 / LOST
    return Equilibrated(A, rows, columns, inverse, regular)


def _root(largest: np.ndarray) -> np.ndarray:
    return 1.0 / np.sqrt(np.where(largest > 0, largest, 1.0))


def _norm(A: np.ndarray) -> np.ndarray:
    return np.abs(A).sum(1).max(1, initial=0.0)
