"""Eq. (9): stiffness without the joints, less what they take away."""

import numpy as np
import pytest
import sympy as sp

from robostiff.elastostatics import Block, chain_stiffness, eliminate_block
from tests.cases.metric import distance
from tests.paper.exact_chain import symmetric
from tests.paper.test_eq07_saddle_point import chain


@pytest.mark.parametrize("joints", [1, 2, 4, 5])
def test_eq_9_is_eq_7(joints: int):
    C, J_q = chain(joints, joints).matrices()
    K0 = np.linalg.inv(C)
    printed = K0 - K0 @ J_q @ np.linalg.inv(J_q.T @ K0 @ J_q) @ J_q.T @ K0
    for K in (eliminate_block(K0, J_q), chain_stiffness(C, J_q, form=Block()).K):
        assert distance(K, printed, sizes_of=K0) <= 1e-9
    assert distance(printed, chain_stiffness(C, J_q).K, sizes_of=K0) <= 1e-9


def test_frobenius_formula_with_symbols():
    """The upper-left block of the inverse in (7) is (9), entry by entry."""
    C = symmetric(3, "c")
    J = sp.Matrix(3, 1, sp.symbols("j1:4"))
    S = sp.Matrix(sp.BlockMatrix([[C, J], [J.T, sp.zeros(1)]]))
    K0 = C.inv()
    eq9 = K0 - K0 * J * (J.T * K0 * J).inv() * J.T * K0
    assert (S.inv()[:3, :3] - eq9).applyfunc(sp.cancel) == sp.zeros(3)
