"""The stiffness matrix by eq. (7) in 50 digits, redundant joints found by exact arithmetic."""

from __future__ import annotations

from fractions import Fraction

import mpmath as mp
import numpy as np


def independent_columns(J_q: np.ndarray) -> list[int]:
    """Columns that are independent of those before them; floats are taken as exact fractions."""
    kept: list[int] = []
    reduced: list[tuple[int, list[Fraction]]] = []  # pivot row, column with a 1 there
    for i in range(J_q.shape[1]):
        column = [Fraction(float(x)) for x in J_q[:, i]]
        for pivot, other in reduced:
            factor = column[pivot]
            if factor:
                column = [a - factor * b for a, b in zip(column, other, strict=True)]
        pivot = next((row for row, entry in enumerate(column) if entry), None)
        if pivot is None:
            continue
        lead = column[pivot]
        reduced.append((pivot, [entry / lead for entry in column]))
        kept.append(i)
    return kept


def exact_stiffness(C: np.ndarray, J_q: np.ndarray) -> tuple[np.ndarray, int]:
    """Upper-left block of [[C, J_q], [J_q^T, 0]]^-1 in 50 digits, and rank n - rank(J_q)."""
    n = C.shape[0]
    kept = independent_columns(J_q)
    with mp.workdps(50):
        S = mp.zeros(n + len(kept))
        for i in range(n):
            for j in range(n):
                S[i, j] = mp.mpf(float(C[i, j]))
            for j, column in enumerate(kept):
                S[i, n + j] = S[n + j, i] = mp.mpf(float(J_q[i, column]))
        inverse = mp.inverse(S)
        K = np.array([[float(inverse[i, j]) for j in range(n)] for i in range(n)])
    return K, n - len(kept)
