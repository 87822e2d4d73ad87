"""Random numbers and counts are the same by machine code and by NumPy, and right."""

import numpy as np
import pytest

from robostiff.compiled import count_by_digits, uniform_rows

KEYS = np.array([0, 2**63 + 5, 12], dtype=np.uint64)
LOW, HIGH = np.array([0.0, -1.3, 5.0]), np.array([1.0, 2.7, 5.0])


@pytest.fixture(params=["numpy", pytest.param("machine code", marks=pytest.mark.needs("llvmlite"))])
def backend(request, monkeypatch):
    if request.param == "numpy":
        monkeypatch.setattr("robostiff.compiled.array_loops._machine_code", lambda: None)


def mixed(z: int) -> int:
    """SplitMix64 in whole numbers of Python."""
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
    return z ^ z >> 31


@pytest.mark.usefixtures("backend")
def test_numbers_are_those_of_the_definition():
    first = 10**9
    found = uniform_rows(KEYS, first, 13, LOW, HIGH)
    for row, key, low, high in zip(found, KEYS, LOW, HIGH, strict=True):
        for k, value in enumerate(row):
            place = (int(key) + (first + k + 1) * 0x9E3779B97F4A7C15) % 2**64
            assert value == (mixed(place) >> 11) * 2.0**-53 * (high - low) + low


@pytest.mark.usefixtures("backend")
def test_numbers_are_spread_evenly_and_independent():
    n = 200_000
    values = uniform_rows(np.arange(6, dtype=np.uint64), 0, n, np.zeros(6), np.ones(6))
    assert np.all((values >= 0) & (values < 1))
    for row in values:
        counts = np.histogram(row, 100, (0, 1))[0]
        # chi squared of 99 degrees of freedom: above 160 once in ten thousand
        assert np.sum((counts - n / 100) ** 2) / (n / 100) < 160
    between = np.corrcoef(np.vstack([values[:, 1:], values[:, :-1]])) - np.eye(12)
    assert np.abs(between).max() < 5 / np.sqrt(n)


@pytest.mark.usefixtures("backend")
def test_counts_are_those_of_the_digits():
    values = np.random.default_rng(1).normal(size=10_001).astype(np.float32)
    values[:5] = 0.0, -0.0, np.inf, -np.inf, np.nan
    pages = (np.arange(2**16) % 300).astype(np.uint32)
    counts = np.ones((300, 64), dtype=int)
    places = count_by_digits(values, pages, counts)
    np.testing.assert_array_equal(places, np.flatnonzero(pages[values.view(np.uint32) >> 16] == 0))
    expected = np.ones((300, 64), dtype=int)
    for bits in values.view(np.uint32).tolist():
        expected[(bits >> 16) % 300, bits >> 10 & 63] += 1
    np.testing.assert_array_equal(counts, expected)
