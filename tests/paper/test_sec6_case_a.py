"""Section VI, case A: eq. (27), its rank 3, and the apex about which the platform turns freely."""

import numpy as np
import pytest
import sympy as sp

from robostiff import stiffness
from robostiff.spatial import screw_of_twist
from tests.generators.machines import case_a
from tests.generators.metric import distance
from tests.paper.exact_chain import case_a_angles, jointed_legs
from tests.paper.home_matrices import CASE_A, aggregated, eq27, leg_vectors

SIZES = [(0.5, 0.2, 0.6), (1.0, 0.7, 0.4), (0.3, 0.29, 1.1)]
K11 = 3.7e6


@pytest.mark.parametrize(("R", "r", "h"), SIZES)
def test_eq_27_entry_by_entry(R: float, r: float, h: float):
    assert distance(aggregated(CASE_A, K11, R, r, h), eq27(K11, R, r, h)) <= 1e-13


def test_eq_27_with_symbols():
    R, r, h = sp.symbols("R r h", positive=True)
    d = R - r
    L2 = d**2 + h**2
    K = jointed_legs(*case_a_angles(), R, r, h, L2)
    expected = sp.diag(d**2, d**2, 2 * h**2, r**2 * h**2, r**2 * h**2, 0)
    expected[0, 4] = expected[4, 0] = r * h * d
    expected[1, 3] = expected[3, 1] = -r * h * d
    assert (K - 3 * expected / L2).applyfunc(sp.simplify) == sp.zeros(6)
    assert expected.rank(simplify=True) == 3
    printed = jointed_legs(*case_a_angles(), R, r, h, L2, sign=+1)
    assert sp.simplify(printed[0, 4] + K[0, 4]) == 0  # the coupling comes out with the other sign
    assert printed[0, 4] != K[0, 4]


@pytest.mark.parametrize(("R", "r", "h"), SIZES)
def test_three_free_turns_about_the_apex(R: float, r: float, h: float):
    K = eq27(K11, R, r, h)
    assert np.linalg.matrix_rank(K, tol=1e-12 * np.abs(K).max()) == 3
    apex = np.array([0, 0, h * r / (R - r)])  # from the platform centre
    for e in np.eye(3):
        turn = np.concatenate([np.cross(e, -apex), e])
        assert np.abs(K @ turn).max() <= 1e-12 * np.abs(K).max() * max(1, apex[2])
        if e[2] == 0:
            point = screw_of_twist(turn, np.zeros(3), 1.0).point
            assert point is not None
            assert np.allclose(point, apex, rtol=0, atol=1e-12 * (1 + apex[2]))


@pytest.mark.parametrize(("R", "r", "h"), SIZES)
def test_all_legs_meet_in_the_apex(R: float, r: float, h: float):
    u, v = leg_vectors(CASE_A, R, r, h)
    apex = np.array([0, 0, h * r / (R - r)])
    for direction, to_centre in zip(u, v, strict=True):
        assert np.abs(np.cross(direction, apex + to_centre)).max() <= 1e-12 * (1 + apex[2]) ** 2


def test_model_of_the_robot():
    """The same platform built of joints and beams: three free motions at home, one elsewhere."""
    robot = case_a(R=0.5, r=0.2, h=0.6)
    home = stiffness(robot)
    length = float(np.hypot(0.3, 0.6))
    beam = 210e9 * np.pi * 0.02**2 / 4 / length
    K = eq27(1 / (1 / beam + 1 / 2e7), 0.5, 0.2, 0.6)
    assert distance(home.K, K) <= 1e-12
    assert int(home.rank) == 3
    rng = np.random.default_rng(1)
    poses = [0, 0, 0.6, 0, 0, 0] + 0.1 * rng.uniform(-1, 1, (8, 6))
    assert (stiffness(robot, poses).rank == 5).all()
