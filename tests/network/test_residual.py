"""Residuals with more digits than their entries, against fractions."""

from fractions import Fraction

import numpy as np
import pytest

from robostiff.network.energy import residual


def exactly(A, x, b):
    """b - A x in fractions."""

    def dot(row, column):
        return sum(Fraction(p) * Fraction(q) for p, q in zip(row, column, strict=True))

    columns = range(x.shape[1])
    rows = [[Fraction(b[i, k]) - dot(A[i], x[:, k]) for k in columns] for i in range(len(A))]
    return np.array([[float(value) for value in row] for row in rows])


@pytest.mark.parametrize("size", [1, 2, 7, 60])
def test_residual_of_a_solution(size):
    rng = np.random.default_rng(size)
    A = rng.normal(size=(size, size)) * 10.0 ** rng.uniform(-6, 3, (size, size))
    x = rng.normal(size=(size, 3)) * 10.0 ** rng.uniform(-8, 2, (size, 3))
    b = A @ x  # rounded: what is left is rounding alone
    largest = np.abs(A).max(axis=1, keepdims=True) * np.abs(x).max(axis=0) * size
    assert np.all(np.abs(residual(A, x, b) - exactly(A, x, b)) <= 1e-21 * largest)


def test_refinement_gives_small_entries_their_own_digits():
    rng = np.random.default_rng(3)
    A = np.round(rng.uniform(-4, 4, (12, 12)) * 64) / 64
    x = np.round(rng.uniform(-4, 4, (12, 1)) * 64) / 64
    x[3] = 2.0**-30
    b = A @ x  # exact
    found = np.linalg.solve(A, b)
    found = found + np.linalg.solve(A, residual(A, found, b))
    assert np.all(np.abs(found - x) <= 4e-16 * np.abs(x))
