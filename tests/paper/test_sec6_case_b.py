"""Section VI, case B: eq. (28)."""

import numpy as np
import pytest
import sympy as sp

from robostiff import stiffness
from tests.generators.machines import case_b
from tests.generators.metric import distance
from tests.paper.exact_chain import case_b_angles, jointed_legs
from tests.paper.home_matrices import CASE_B, aggregated, eq28, leg_vectors

SIZES = [(0.5, 0.2, 0.6), (1.0, 0.7, 0.4), (0.3, 0.29, 1.1)]
K11 = 3.7e6


@pytest.mark.parametrize(("R", "r", "h"), SIZES)
def test_eq_28_entry_by_entry(R: float, r: float, h: float):
    assert distance(aggregated(CASE_B, K11, R, r, h), eq28(K11, R, r, h)) <= 1e-13


@pytest.mark.parametrize(("R", "r", "h"), SIZES)
def test_eq_25_corrected_and_printed(R: float, r: float, h: float):
    u, v = leg_vectors(CASE_B, R, r, h)
    unit = u / np.linalg.norm(u, axis=1, keepdims=True)
    right = np.hstack([unit, -np.cross(v, unit)])
    printed = np.hstack([unit, np.cross(v, unit)])
    assert distance(K11 * right.T @ right, eq28(K11, R, r, h)) <= 1e-13
    assert distance(K11 * printed.T @ printed, eq28(K11, R, r, h)) > 1e-3
    # the moments about the reference point by (E - P) x u
    assert np.allclose(right[:, 3:], np.cross(-v, unit), rtol=0, atol=1e-15)


def test_eq_28_with_symbols():
    R, r, h = sp.symbols("R r h", positive=True)
    d, b = R - r, R / 2 - r
    L2 = R**2 - R * r + r**2 + h**2
    K = jointed_legs(*case_b_angles(), R, r, h, L2)
    side = d**2 + R * r
    last = sp.Rational(3, 2) * r**2 * R**2
    expected = sp.diag(side, side, 2 * h**2, r**2 * h**2, r**2 * h**2, last)
    expected[0, 4] = expected[4, 0] = r * h * b
    expected[1, 3] = expected[3, 1] = -r * h * b
    assert (K - 3 * expected / L2).applyfunc(sp.simplify) == sp.zeros(6)
    assert sp.simplify(expected.det()) != 0
    printed = jointed_legs(*case_b_angles(), R, r, h, L2, sign=+1)
    assert sp.simplify(printed[0, 4] + K[0, 4]) == 0
    assert sp.simplify(printed[0, 4] - K[0, 4]) != 0


def test_leg_lengths():
    """One symbol L in the paper, two lengths in fact."""
    R, r, h = 0.5, 0.2, 0.6
    u, _ = leg_vectors(CASE_B, R, r, h)
    assert np.allclose((u**2).sum(axis=1), R * R - R * r + r * r + h * h, rtol=1e-14)
    assert not np.isclose(R * R - R * r + r * r, (R - r) ** 2)


def test_model_of_the_robot():
    """Joints, beams and actuators at home: K11 is the beam and the actuator in series."""
    robot = case_b(R=0.5, r=0.2, h=0.6)
    length = float(np.sqrt(0.25 - 0.1 + 0.04 + 0.36))
    beam = 210e9 * np.pi * 0.02**2 / 4 / length
    result = stiffness(robot)
    assert distance(result.K, eq28(1 / (1 / beam + 1 / 2e7), 0.5, 0.2, 0.6)) <= 1e-12
    assert int(result.rank) == 6
