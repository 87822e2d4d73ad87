"""Proposition and Corollary: eq. (10) and (15) in any order, by columns or groups of columns."""

from itertools import permutations

import numpy as np
import pytest
import sympy as sp

from robostiff.analytic import canonical, rank_formula
from robostiff.elastostatics import Recursive, chain_stiffness, eliminate_block
from tests.cases.metric import distance
from tests.paper.exact_chain import block_form, eliminated, generic, symmetric, vanishes
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


# Three general joints: K0 = A^T A turns J_q into A J_q for K0 = I, a rotation of coordinates then
# clears three entries, and the length of a column does not matter.
a, b, c, d, e = sp.symbols("a:e")
UNIT, THREE = sp.eye(4), sp.Matrix([[1, a, b], [0, 1, c], [0, d, 1], [0, 0, e]])


def test_a_change_of_coordinates_changes_nothing_else():
    """Eq. (9) for A^T A and J is A^T (eq. (9) for I and A J) A."""
    A, J = generic(3, 3, "a"), generic(3, 2)
    assert vanishes(block_form(A.T * A, J) - A.T * block_form(sp.eye(3), A * J) * A)


def test_proposition_with_symbols():
    """Any grouping of three general joints, each group in any order, is (9) at once."""
    at_once = block_form(UNIT, THREE)
    for groups in (([0], [1, 2]), ([1, 2], [0]), ([2, 0], [1]), ([1], [0, 2])):
        K = UNIT
        for group in groups:
            K = canonical(block_form(K, THREE[:, group]))
        assert vanishes(K - at_once)


def test_corollary_with_symbols():
    """Single joints by (15), in all six orders, and the general K0 of a planar link."""
    at_once = block_form(UNIT, THREE)
    for order in permutations(range(3)):
        K = UNIT
        for i in order:
            K = canonical(eliminated(K, THREE[:, i]))
        assert vanishes(K - at_once)
    K0, J = symmetric(3), generic(3, 2)
    assert vanishes(block_form(block_form(K0, J[:, 1]), J[:, 0]) - block_form(K0, J))


def test_a_redundant_joint_has_no_mu_with_symbols():
    """The condition of the Proposition: J^T K J is zero for what earlier joints span."""
    K = canonical(block_form(symmetric(3), generic(3, 2)))
    again = generic(3, 2) * generic(2, 1, "c")
    assert vanishes(again.T * K * again)


def test_each_joint_takes_one_from_the_rank_with_symbols():
    """Eq. (16): the minors of size n - n_q remain, those that are one larger vanish."""
    K = UNIT
    for i in range(3):
        K = canonical(eliminated(K, THREE[:, i]))
        assert rank_formula(K).rank == 3 - i
