"""Section VI: (27) and (28), their ranks, and the same platforms built of joints and beams."""

import numpy as np
import pytest
import sympy as sp

from robostiff import stiffness
from tests.cases.metric import distance
from tests.generators.machines import case_a, case_b
from tests.paper.exact_chain import case_a_angles, case_b_angles, jointed_legs
from tests.paper.home_matrices import entries27, entries28, eq27, eq28


@pytest.mark.parametrize(
    ("angles", "entries", "rank"), [(case_a_angles, entries27, 3), (case_b_angles, entries28, 6)]
)
def test_eq_27_and_28_with_symbols(angles, entries, rank: int):
    R, r, h, L2 = sp.symbols("R r h L2", positive=True)  # L^2 of the legs is in test_slips
    K, expected = jointed_legs(*angles(), R, r, h, L2), sp.Matrix(entries(R, r, h))
    assert (K - 3 * expected / L2).expand() == sp.zeros(6)
    assert expected.rank(simplify=True) == rank
    printed = jointed_legs(*angles(), R, r, h, L2, sign=+1)
    assert sp.simplify(printed[0, 4] + K[0, 4]) == 0  # the coupling comes out with the other sign
    assert sp.simplify(printed[0, 4] - K[0, 4]) != 0


R, r, h = 0.5, 0.2, 0.6


@pytest.mark.parametrize(
    ("make", "square", "equation", "rank"),
    [(case_a, (R - r) ** 2 + h * h, eq27, 3), (case_b, R * R - R * r + r * r + h * h, eq28, 6)],
)
def test_models_of_the_robots(make, square: float, equation, rank: int):
    """Joints, beams and actuators at home: K11 is the beam and the actuator in series."""
    beam = 210e9 * np.pi * 0.02**2 / 4 / np.sqrt(square)
    result = stiffness(make(R=R, r=r, h=h))
    assert distance(result.K, equation(1 / (1 / beam + 1 / 2e7), R, r, h)) <= 1e-12
    assert int(result.rank) == rank


def test_case_a_has_one_free_motion_elsewhere():
    poses = [0, 0, h, 0, 0, 0] + 0.1 * np.random.default_rng(1).uniform(-1, 1, (8, 6))
    assert (stiffness(case_a(R=R, r=r, h=h), poses).rank == 5).all()
