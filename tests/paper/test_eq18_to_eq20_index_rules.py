"""Eq. (18)-(20): trivial and quasi-trivial joints by indices alone."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.elastostatics import eliminate_index, eliminate_joint, eliminate_quasi_trivial
from tests.cases.metric import distance
from tests.paper.exact_chain import eliminated, symmetric

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


@pytest.mark.parametrize("p", [-1, 6])
def test_out_of_range(p: int):
    with pytest.raises(ValueError, match="expected 0 to 5"):
        eliminate_index(K0, p)
