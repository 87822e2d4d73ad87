"""Springs: what an Elasticity holds, springs along one axis, and their messages."""

import dataclasses

import numpy as np
import pytest
import sympy as sp

from robostiff.elasticity import Elasticity, rotational_spring, translational_spring


def test_arrays_are_copied_and_read_only():
    C, N = np.eye(6), np.eye(6)[:, :2]
    spring = Elasticity(C, N)
    C[0, 0] = N[0, 0] = 7
    assert spring.compliance[0, 0] == spring.freedoms[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        spring.compliance[0, 0] = 2
    with pytest.raises(ValueError, match="read-only"):
        spring.freedoms[0, 0] = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        spring.compliance = C  # type: ignore[misc]


def test_no_freedoms_unless_given():
    a, b = Elasticity(np.eye(6)), Elasticity(np.eye(6))
    assert a.freedoms.shape == (6, 0)
    assert a.freedoms is not b.freedoms


def test_batches_and_integers():
    spring = Elasticity(np.zeros((4, 2, 6, 6), dtype=int))
    assert spring.compliance.shape == (4, 2, 6, 6)
    assert spring.compliance.dtype == np.float64


def test_symbolic_entries_stay():
    k = sp.Symbol("k")
    compliance = np.full((6, 6), 0, dtype=object)
    compliance[0, 0] = 1 / k
    assert Elasticity(compliance).compliance[0, 0] == 1 / k


@pytest.mark.parametrize(
    ("make", "block"), [(translational_spring, slice(0, 3)), (rotational_spring, slice(3, 6))]
)
def test_springs_along_one_axis(make, block):
    axis = np.array([1.0, -2.0, 2.0])
    spring = make(4e3, axis)
    assert spring.freedoms.shape == (6, 0)
    compliance = spring.compliance[block, block]
    np.testing.assert_allclose(compliance @ axis, axis / 4e3, rtol=1e-14)
    np.testing.assert_allclose(compliance @ [0, 1, 1], 0, atol=1e-19)
    rest = spring.compliance.copy()
    rest[block, block] = 0
    assert (rest == 0).all()
    np.testing.assert_allclose(make(4e3, -3 * axis).compliance, spring.compliance, rtol=1e-14)
