"""The paper's formulas, derived by the engine and compared entry by entry."""

from itertools import permutations

import numpy as np
import pytest
import sympy as sp

from robostiff.analytic import Steps, derive_chain
from robostiff.elastostatics import eliminate_joint

L = sp.Symbol("L", positive=True)
FIVE = {  # eq. (21)
    "Rx": [0, 0, 0, 1, 0, 0],
    "Ry": [0, 0, 0, 0, 1, 0],
    "Rz": [0, 0, 0, 0, 0, 1],
    "Ry+": [0, 0, -L, 0, 1, 0],
    "Rz+": [0, L, 0, 0, 0, 1],
}
FULL = sp.Matrix(6, 6, lambda i, j: sp.Symbol(f"K{min(i, j) + 1}{max(i, j) + 1}"))


def numbers(expression, values):
    return np.array(sp.Matrix(expression).evalf(30, subs=values), dtype=float)


@pytest.mark.parametrize("order", list(permutations(range(5)))[::17])
def test_proposition_any_order_gives_the_same_matrix(order):
    names = list(FIVE)
    shuffled = {names[i]: FIVE[names[i]] for i in order}
    assert derive_chain(FULL, shuffled).K == derive_chain(FULL, FIVE).K


def test_steps_equal_the_closed_form_and_the_numerical_form():
    generator = np.random.default_rng(1)
    M = generator.normal(size=(6, 6))
    K0 = M @ M.T + 6 * np.eye(6)
    general = {f"j{i}": sp.symbols(f"d{i}x d{i}y d{i}z e{i}x e{i}y e{i}z") for i in range(4)}
    values = {FULL[i, j]: K0[i, j] for i in range(6) for j in range(i, 6)}
    expected = K0
    for column in general.values():
        twist = generator.normal(size=6)
        values |= dict(zip(column, twist, strict=True))
        expected = eliminate_joint(expected, twist)
    stepped = derive_chain(FULL, general, Steps())
    found = np.array(stepped.substituted(values), dtype=float)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(K0).max())
    closed = derive_chain(FULL, dict(list(general.items())[:1]))
    short = derive_chain(FULL, dict(list(general.items())[:1]), Steps())
    np.testing.assert_allclose(
        numbers(closed.K, values), np.array(short.substituted(values), dtype=float), rtol=1e-10
    )
