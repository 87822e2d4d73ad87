"""Proposition and Corollary: eq. (10) and (15) in any order, by columns or groups of columns."""

from itertools import permutations

import numpy as np
import pytest
import sympy as sp

from robostiff.elastostatics import Recursive, chain_stiffness, eliminate_block, eliminate_joint
from tests.generators.metric import distance
from tests.paper.exact_chain import eliminated, symmetric
from tests.paper.test_eq07_saddle_point import chain

GROUPINGS = [
    ((0, 1, 2, 3),),
    ((3, 2), (1, 0)),
    ((1,), (0, 3, 2)),
    ((2, 0, 1), (3,)),
    ((3,), (2,), (1,), (0,)),
]


@pytest.mark.parametrize("groups", GROUPINGS)
def test_any_grouping(groups: tuple[tuple[int, ...], ...]):
    C, J_q = chain(1, 4).matrices()
    K0 = np.linalg.inv(C)
    all_at_once = eliminate_block(K0, J_q)
    K = K0
    for group in groups:
        J = J_q[:, list(group)]
        K = K - K @ J @ np.linalg.inv(J.T @ K @ J) @ J.T @ K
    assert distance(K, all_at_once, sizes_of=K0) <= 1e-9
    result = chain_stiffness(C, J_q, form=Recursive(groups=groups))
    assert distance(result.K, all_at_once, sizes_of=K0) <= 1e-9


def test_any_order_of_single_joints():
    C, J_q = chain(2, 4).matrices()
    K0 = np.linalg.inv(C)
    expected = chain_stiffness(C, J_q).K
    for order in permutations(range(4)):
        K = K0
        for i in order:
            K = eliminate_joint(K, J_q[:, i])
        assert distance(K, expected, sizes_of=K0) <= 1e-9


def test_two_joints_in_either_order_with_symbols():
    K = symmetric(3)
    J1 = sp.Matrix([1, 0, sp.Symbol("a")])
    J2 = sp.Matrix([0, sp.Symbol("b"), 1])
    difference = eliminated(eliminated(K, J1), J2) - eliminated(eliminated(K, J2), J1)
    assert difference.applyfunc(sp.cancel) == sp.zeros(3)


def test_wrong_recursion_is_caught():
    """u^T u in place of J^T u for mu."""
    C, J_q = chain(3, 2).matrices()
    K0 = np.linalg.inv(C)
    u = K0 @ J_q[:, 0]
    wrong = K0 - np.outer(u, u) / (u @ u)
    assert distance(wrong, eliminate_joint(K0, J_q[:, 0])) > 1e-3
