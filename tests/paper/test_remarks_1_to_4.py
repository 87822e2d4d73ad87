"""Remarks 1 to 4: when the terms of (9) exist, and what their difference is."""

from itertools import combinations

import pytest
import sympy as sp

from tests.paper.exact_chain import block_form, generic, symmetric, vanishes


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
