"""Eq. (1)-(4): a planar link with a passive joint at its tip."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.elastostatics import eliminate_index
from tests.paper.exact_chain import symmetric

FORMS = [rs.WrenchBasis(), rs.Block(), rs.Recursive(), rs.SaddlePoint(), rs.IndexRules()]


def eq4(K: np.ndarray) -> np.ndarray:
    """The matrix as printed."""
    Kp = np.zeros((3, 3))
    Kp[0, 0] = K[0, 0] - K[0, 2] * K[2, 0] / K[2, 2]
    Kp[0, 1] = K[0, 1] - K[2, 1] * K[0, 2] / K[2, 2]
    Kp[1, 0] = K[1, 0] - K[1, 2] * K[2, 0] / K[2, 2]
    Kp[1, 1] = K[1, 1] - K[1, 2] * K[2, 1] / K[2, 2]
    return Kp


def test_second_derivatives_of_the_least_energy():
    """Eq. (2) and (3) with symbols lead to (4)."""
    K = symmetric(3)
    x, y, phi = sp.symbols("x y phi")
    t = sp.Matrix([x, y, phi])
    E = (t.T * K * t)[0] / 2
    best = sp.solve(sp.diff(E, phi), phi)[0]
    assert sp.simplify(best + (K[0, 2] * x + K[1, 2] * y) / K[2, 2]) == 0
    Ep = E.subs(phi, best)
    hessian = sp.hessian(Ep, (x, y))
    for i in range(2):
        for j in range(2):
            assert sp.simplify(hessian[i, j] - (K[i, j] - K[i, 2] * K[2, j] / K[2, 2])) == 0


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize("seed", range(5))
def test_all_forms_give_eq_4(form, seed: int):
    A = np.random.default_rng(seed).normal(size=(3, 3))
    K = A @ A.T + 0.2 * np.eye(3)
    result = rs.chain_stiffness(np.linalg.inv(K), [[0.0], [0.0], [1.0]], form=form)
    assert np.allclose(result.K, eq4(K), rtol=0, atol=1e-12 * np.abs(K).max())
    assert np.allclose(eliminate_index(K, 2), eq4(K), rtol=0, atol=1e-15 * np.abs(K).max())
    assert int(result.rank) == 2


def test_setting_the_row_and_column_to_zero_is_wrong_for_a_beam():
    L, EI = 2.0, 3.0
    K = np.array(
        [[5.0, 0, 0], [0, 12 * EI / L**3, -6 * EI / L**2], [0, -6 * EI / L**2, 4 * EI / L]]
    )
    result = rs.chain_stiffness(np.linalg.inv(K), [[0.0], [0.0], [1.0]])
    assert np.isclose(result.K[1, 1], 3 * EI / L**3, rtol=1e-13)
    assert np.isclose(K[1, 1] / result.K[1, 1], 4.0)  # what the trivial rule would keep
