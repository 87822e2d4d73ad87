"""Factors, solutions and inverses of recorded symmetric matrices."""

from __future__ import annotations

import numpy as np
import pytest

from robostiff.record import Record
from robostiff.recorded import Factors, factors_of, inverse_entries
from tests.recorded.at_samples import sample, samples, symmetric

COUNT = 4


def recorded_matrices(size: int, rank: int, seed: int) -> tuple[Record, dict, np.ndarray]:
    """K = W W^T of an input W, so that its rank is the same at all samples."""
    rng = np.random.default_rng(seed)
    W = rng.normal(size=(COUNT, size, rank))
    record = Record({f"w{i}{j}": W[:, i, j] for i in range(size) for j in range(rank)})
    w = [[record.input(f"w{i}{j}") for j in range(rank)] for i in range(size)]
    K = {
        (i, j): sum((w[i][k] * w[j][k] for k in range(1, rank)), w[i][0] * w[j][0])
        for i in range(size)
        for j in range(i, size)
    }
    return record, K, W @ np.swapaxes(W, -1, -2)


def product(factors: Factors, k: int) -> np.ndarray:
    """Sum of l l^T d at a sample."""
    total = np.zeros((factors.size, factors.size))
    for column, d in zip(factors.columns, factors.d, strict=True):
        own = samples(column, k)
        total += np.outer(own, own) * sample(d, k)
    return total


@pytest.mark.parametrize(("size", "rank"), [(3, 1), (3, 3), (6, 4), (6, 5), (6, 6)])
@pytest.mark.parametrize("seed", range(3))
def test_factors_multiply_to_the_matrix(size: int, rank: int, seed: int):
    _, K, expected = recorded_matrices(size, rank, seed)
    factors = factors_of(K, size)
    assert factors.rank == rank
    for k in range(COUNT):
        assert np.abs(product(factors, k) - expected[k]).max() <= 1e-9 * np.abs(expected[k]).max()


@pytest.mark.parametrize("seed", range(3))
def test_solution_and_inverse(seed: int):
    _, K, expected = recorded_matrices(6, 6, seed)
    F = np.random.default_rng(seed).normal(size=6)
    factors = factors_of(K, 6)
    x, inverse = factors.solved(F.tolist()), inverse_entries(factors)
    for k in range(COUNT):
        allowed = 1e-14 * np.linalg.cond(expected[k]) * np.linalg.norm(np.linalg.inv(expected[k]))
        found = symmetric(inverse, 6, k)
        assert np.abs(found - np.linalg.inv(expected[k])).max() <= allowed
        solution = np.linalg.solve(expected[k], F)
        assert np.abs(samples(x, k) - solution).max() <= allowed * np.linalg.norm(F)


def test_a_load_of_zeros_leaves_no_trace():
    record, K, _ = recorded_matrices(3, 3, 0)
    factors = factors_of(K, 3)
    size = record.size
    assert factors.solved([0, 0, 0]) == [0, 0, 0]
    assert record.size == size


def test_blocks_that_are_apart_stay_apart():
    record = Record({"a": [2.0, 3.0], "b": [5.0, 4.0]})
    a, b = record.input("a"), record.input("b")
    K = {(0, 0): a, (0, 1): 0, (1, 1): b}
    factors = factors_of(K, 2)
    inverse = inverse_entries(factors)
    assert inverse[0, 1] == 0
    assert inverse[0, 0].sample == pytest.approx(1 / a.sample)


def test_losses_tell_pivots_that_are_lost():
    """Of diag(2, s), the loss grows as s falls below what it is at the samples."""
    record = Record({"s": [1.0, 1.2]})
    s = record.input("s")
    factors = factors_of({(0, 0): 2.0, (0, 1): 0, (1, 1): s}, 2)
    (loss,) = factors.losses
    assert loss.sample == pytest.approx(1.1 / s.sample)
    coupled = factors_of({(0, 0): 1.0, (0, 1): s * 0.5, (1, 1): 1.0}, 2)
    (loss,) = coupled.losses  # a pivot of 1 - s^2/4, where there is 1, here and at the samples
    assert np.allclose(loss.sample, 2 / (1 - 0.25 * s.sample**2))
