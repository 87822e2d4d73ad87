"""(18) to (20) of the paper, rules of indices, and its remarks 1 to 4."""

from itertools import combinations

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.elastostatics import eliminate_index, eliminate_joint, eliminate_quasi_trivial
from tests.cases.metric import distance
from tests.paper.exact_chain import block_form, eliminated, generic, symmetric, vanishes

A = np.random.default_rng(2).normal(size=(6, 6))
K0 = A @ A.T + 0.3 * np.eye(6)
AXES = [(p, axis, sign) for p in (3, 4, 5) for axis in range(3) for sign in (1, -1)]


@pytest.mark.parametrize("p", range(6))
def test_trivial_joint(p: int):
    """(19) as corrected, K_jp K_pk; row and column p vanish for all k, (20)."""
    K = eliminate_index(K0, p)
    for j in range(6):
        for k in range(6):
            assert np.isclose(K[j, k], K0[j, k] - K0[j, p] * K0[p, k] / K0[p, p], atol=1e-13)
    assert not K[p, :].any()
    assert not K[:, p].any()
    assert np.count_nonzero(np.abs(K).max(axis=0) > 0) == 5  # and no others do
    assert np.allclose(K, eliminate_joint(K0, np.eye(6)[p]), rtol=0, atol=1e-13)


@pytest.mark.parametrize(("p", "axis", "sign"), AXES)
def test_quasi_trivial_joint(p: int, axis: int, sign: int):
    """A turn about a frame axis, at a distance along a frame axis: columns (18)."""
    L = 0.7
    r = sign * L * np.eye(3)[axis]
    e = np.eye(3)[p - 3]
    d = np.cross(e, r)
    column = np.concatenate([d, e])
    assert column[p - 3] == 0  # the structure of (18): no shift along its own axis
    assert set(np.abs(column)) <= {0.0, L, 1.0}
    K = eliminate_quasi_trivial(K0, p, d)
    assert np.allclose(K, eliminate_joint(K0, column), rtol=0, atol=1e-12)
    result = rs.chain_stiffness(np.linalg.inv(K0), column[:, None], form=rs.IndexRules())
    assert distance(result.K, K) <= 1e-11


def test_rule_with_symbols():
    K = symmetric(6)
    for p in range(6):
        J = sp.zeros(6, 1)
        J[p] = 1
        expected = eliminated(K, J)
        rule = sp.Matrix(6, 6, lambda j, k, p=p: K[j, k] - K[j, p] * K[p, k] / K[p, p])
        assert (rule - expected).applyfunc(sp.cancel) == sp.zeros(6)


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
