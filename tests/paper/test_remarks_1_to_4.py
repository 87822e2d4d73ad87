"""Remarks 1 to 4: when the terms of (9) exist, and what their difference is."""

from itertools import combinations

import numpy as np
import pytest
import sympy as sp

from robostiff import NoAnswerError
from robostiff.elastostatics import Block, chain_stiffness
from tests.paper.exact_chain import block_form, generic, symmetric, vanishes
from tests.paper.test_eq07_saddle_point import chain


@pytest.mark.parametrize("springs", range(1, 9))
def test_remark_1_first_term_needs_six_independent_springs(springs: int):
    J_theta = np.random.default_rng(springs).normal(size=(6, springs))
    C = 1e-6 * J_theta @ J_theta.T
    result = chain_stiffness(C, np.eye(6)[:, :1], form=Block())
    regular = np.linalg.matrix_rank(J_theta) == 6
    assert bool(result.answered) == regular
    if not regular:
        with pytest.raises(NoAnswerError, match=r"rank\(J_theta\) < n"):
            _ = result.K


def test_remark_2_second_term_needs_independent_joints():
    C, J_q = chain(1, 3).matrices()
    assert chain_stiffness(C, J_q, form=Block()).answered
    dependent = np.hstack([J_q, J_q @ np.ones((3, 1))])
    refused = chain_stiffness(C, dependent, form=Block())
    assert not refused.answered
    M = dependent.T @ np.linalg.inv(C) @ dependent
    assert np.linalg.matrix_rank(M, tol=1e-9 * np.abs(M).max()) == 3


@pytest.mark.parametrize("joints", range(6))
def test_remark_3_rank(joints: int):
    """6 - n_q for independent joints; 6 - rank(J_q) whatever they are."""
    C, J_q = chain(2, joints).matrices()
    assert int(chain_stiffness(C, J_q).rank) == 6 - joints
    doubled = np.hstack([J_q, J_q])
    assert int(chain_stiffness(C, doubled).rank) == 6 - joints


@pytest.mark.parametrize("seed", range(5))
def test_remark_4_symmetric_and_semidefinite(seed: int):
    C, J_q = chain(seed, 2).matrices()
    K = chain_stiffness(C, J_q, form=Block()).K
    assert np.array_equal(K, K.T)
    values = np.linalg.eigvalsh(K)
    assert values[0] >= -1e-12 * np.abs(np.linalg.inv(C)).max()
    assert values[-1] > 0


@pytest.mark.parametrize("springs", [1, 2, 3, 4])
def test_remark_1_with_symbols(springs: int):
    """Cauchy-Binet: det C is the sum of squared minors of J_theta over their springs.

    With positive springs it is zero when all minors are, so when rank(J_theta) < n: here n = 3.
    """
    J_theta, k = generic(3, springs), sp.symbols(f"k1:{springs + 1}")
    C = J_theta * sp.diag(*(1 / spring for spring in k)) * J_theta.T
    squares = sp.Integer(0)
    for choice in combinations(range(springs), 3):
        minor = J_theta.extract(range(3), list(choice)).det()
        squares += minor**2 / sp.prod(k[i] for i in choice)
    assert vanishes(sp.Matrix([C.det(method="berkowitz") - squares]))
    assert (squares == 0) == (springs < 3)


@pytest.mark.parametrize("joints", [1, 2])
def test_remark_2_with_symbols(joints: int):
    """det(J_q^T K0 J_q) is the sum of squared minors of J_q with their springs, for diagonal K0.

    It is zero when all minors are, so when rank(J_q) < n_q; any other K0 is A^T A, which turns J_q
    into A J_q of the same rank.
    """
    J, k = generic(4, joints), sp.symbols("k1:5", positive=True)
    squares = sp.Integer(0)
    for choice in combinations(range(4), joints):
        minor = J.extract(list(choice), range(joints)).det(method="berkowitz")
        squares += minor**2 * sp.prod(k[i] for i in choice)
    M = J.T * sp.diag(*k) * J
    assert (M.det(method="berkowitz") - squares).expand() == 0
    dependent = J.row_join(J * generic(joints, 1, "c"))
    M = dependent.T * dependent
    assert M.det(method="berkowitz").expand() == 0


@pytest.mark.parametrize("joints", [1, 2])
def test_remark_3_with_symbols(joints: int):
    """C K_C is a projector of trace n - n_q, and that is the rank of a projector."""
    K0, J = symmetric(3), generic(3, joints)
    K = block_form(K0, J)
    assert vanishes(K - K.T)
    assert vanishes(K * J)
    projector = K0.adjugate() / K0.det() * K
    assert vanishes(projector * projector - projector)
    assert vanishes(sp.Matrix([projector.trace() - (3 - joints)]))


@pytest.mark.parametrize("joints", [1, 2])
def test_remark_4_with_symbols(joints: int):
    """K_C = P^T K0 P: a congruence keeps the sign of t^T K0 t, and P has a null space."""
    K0, J = symmetric(3), generic(3, joints)
    M = J.T * K0 * J
    P = sp.eye(3) - J * M.adjugate() * J.T * K0 / M.det()
    assert vanishes(P.T * K0 * P - block_form(K0, J))
    assert vanishes(P * J)
