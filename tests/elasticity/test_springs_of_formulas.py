"""Springs and tapered beams whose numbers are formulas, against the same ones of numbers."""

import numpy as np
import pytest
import sympy as sp

from robostiff.elasticity import (
    BeamSegment,
    Material,
    circle,
    elasticity_from_compliance,
    elasticity_from_stiffness,
    moved,
    tapered_compliance,
)
from robostiff.errors import InputError

k, c, L, d = sp.symbols("k c L d", positive=True)
VALUES = {k: 3e6, c: 2e3, L: 0.4, d: 0.02}


def at_values(formulas):
    return np.array(sp.Matrix(np.atleast_2d(formulas)).subs(VALUES).tolist(), dtype=float)


def test_coupled_stiffness_is_inverted():
    K = sp.diag(k, k, 2 * k, c, c, c)
    K[1, 5] = K[5, 1] = -k * L / 100
    found = elasticity_from_stiffness(K)
    wanted = elasticity_from_stiffness(at_values(K))
    assert found.freedoms.shape == (6, 0)
    np.testing.assert_allclose(at_values(found.compliance), wanted.compliance, rtol=1e-12)


def test_zero_stiffness_is_a_freedom():
    found = elasticity_from_stiffness(sp.diag(k, k, k, c, 0, c))
    assert found.freedoms.T.tolist() == [[0, 0, 0, 0, 1, 0]]
    assert found.compliance[3, 3] == 1 / c
    assert found.compliance[4, 4] == 0


def test_numbers_that_leave_a_coupled_direction_free_are_computed_as_numbers():
    K = np.diag([2, 2, 2, 1, 1, 1]).astype(object)
    K[0, 1] = K[1, 0] = 2
    exact = np.vectorize(sp.Integer, otypes=[object])(K)
    found, wanted = elasticity_from_stiffness(exact), elasticity_from_stiffness(K.astype(float))
    np.testing.assert_array_equal(found.compliance, wanted.compliance)
    assert found.freedoms.shape == (6, 1)


def test_spring_is_moved_exactly():
    a = sp.Symbol("a", real=True)
    turn = [[sp.cos(a), -sp.sin(a), 0], [sp.sin(a), sp.cos(a), 0], [0, 0, 1]]
    hinge = elasticity_from_compliance(sp.diag(0, 0, 0, 0, 0, 1 / c))
    found = moved(hinge, turn, [L, 0, 0])
    assert found.compliance[1, 1] == L**2 / c
    assert found.compliance[1, 5] == L / c


def test_two_halves_make_the_whole():
    soft = Material("soft", E=2e11, G=8e10)
    half = BeamSegment(L / 2, soft, circle(d))
    halves = sp.Matrix(tapered_compliance([half, half]))
    whole = sp.Matrix(tapered_compliance([BeamSegment(L, soft, circle(d))]))
    assert sp.simplify(halves - whole) == sp.zeros(6, 6)


def test_length_of_numbers_beside_a_symbolic_section_stays_exact():
    segment = BeamSegment(0.25, Material("soft", E=2e11, G=8e10), circle(d))
    found = tapered_compliance([segment, segment])
    assert not any(sp.sympify(entry).has(sp.Float) for entry in found.flat)
    assert found[0, 0] == sp.Rational(1, 10**11) / (sp.pi * d**2)


def test_entries_beside_the_diagonal_are_bounded():
    """Only the diagonal was: a matrix with a negative eigenvalue became a spring."""
    e = sp.Symbol("e", real=True)
    M = sp.diag(k, k, k, c, c, c)
    M[1, 5] = M[5, 1] = e
    for make in (elasticity_from_stiffness, elasticity_from_compliance):
        (bound,) = make(M).bounds
        assert sp.expand(bound.value - (k * c - e**2)) == 0
        with pytest.raises(InputError, match="no negative eigenvalue"):
            make(M.subs(e, 2 * sp.sqrt(k * c)))


def test_a_compliance_that_vanishes_identically_is_no_bound():
    """Of a lever, whose two rows are one."""
    e = sp.Symbol("e", real=True)
    M = sp.zeros(6)
    M[:2, :2] = sp.Matrix([1, e]) * sp.Matrix([[1, e]]) / k
    assert not elasticity_from_compliance(M).bounds
