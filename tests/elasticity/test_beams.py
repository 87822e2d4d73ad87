"""Compliance of beams: closed forms, in numbers and symbols, of one section and tapered."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.elasticity import (
    beam_compliance,
    beam_stiffness,
    cantilever_compliance,
    cantilever_stiffness,
    tapered_compliance,
)

THEORIES = [rs.EulerBernoulli(), rs.Timoshenko()]
ALUMINIUM = rs.Material("aluminium", E=70e9, G=26e9)
# All six numbers and both shear factors differ: an exchange of axes cannot hide.
ODD = rs.CrossSection(
    A=1.3e-3, Iy=2.1e-7, Iz=5.5e-7, J=3.7e-7, shear_factor_y=0.81, shear_factor_z=0.43
)


@pytest.mark.parametrize("shape", [(), (3, 1, 2, 1), (0,)])
@pytest.mark.parametrize("theory", THEORIES)
@pytest.mark.parametrize("function", [beam_compliance, beam_stiffness])
def test_batches_of_lengths(function, theory, shape):
    L = np.random.default_rng(1).uniform(0.2, 2.0, shape)
    batch = function(L, ALUMINIUM, ODD, theory)
    assert batch.shape == (*shape, 6, 6)
    assert batch.dtype == np.float64
    for index in np.ndindex(*shape):
        single = function(float(L[index]), ALUMINIUM, ODD, theory)
        np.testing.assert_allclose(batch[index], single, rtol=1e-14, atol=0)


def test_whole_numbers_and_lists_are_lengths_too():
    expected = beam_compliance(2.0, ALUMINIUM, ODD)
    np.testing.assert_array_equal(beam_compliance(2, ALUMINIUM, ODD), expected)
    np.testing.assert_array_equal(beam_compliance([1, 2], ALUMINIUM, ODD)[1], expected)
    # int16 would overflow in L^3 at 40.
    small = beam_compliance(np.int16(40), ALUMINIUM, ODD)
    np.testing.assert_array_equal(small, beam_compliance(40.0, ALUMINIUM, ODD))


@pytest.mark.parametrize("shear", [(), (Fraction(5, 6), Fraction(6, 7))])
def test_exact_inverse_in_fractions(shear):
    beam = [Fraction(n, 7) for n in (5, 11, 3, 2, 13, 17, 19)]
    C, K = cantilever_compliance(*beam, *shear), cantilever_stiffness(*beam, *shear)
    assert C.dtype == K.dtype == object
    assert (C @ K == np.eye(6, dtype=int)).all()


def test_symbols_give_the_formulas():
    L, E, G, A, Iy, Iz, J, ky, kz = sp.symbols("L E G A Iy Iz J ky kz", positive=True)
    C = cantilever_compliance(L, E, G, A, Iy, Iz, J)
    assert C[1, 1] == L**3 / (3 * E * Iz)
    assert C[2, 4] == C[4, 2] == -(L**2) / (2 * E * Iy)
    assert C[0, 1] == 0
    assert type(C[0, 1]) is int
    K = cantilever_stiffness(L, E, G, A, Iy, Iz, J, ky, kz)
    C = cantilever_compliance(L, E, G, A, Iy, Iz, J, ky, kz)
    assert sp.Matrix(C @ K).applyfunc(sp.simplify) == sp.eye(6)
    assert sp.simplify(C[2, 2] - C[2, 2].subs(kz, sp.oo)) == L / (kz * G * A)


def test_a_symbol_beside_numbers():
    L = sp.Symbol("L")
    C = cantilever_compliance(L, 2, 1, 1, 1, 1, 1)
    assert C[1, 1] == L**3 / 6
    batch = cantilever_compliance(np.array([L, 2 * L]), 2, 1, 1, 1, 1, 1)
    assert batch.shape == (2, 6, 6)
    assert batch[1, 0, 0] == L


def test_any_entry_may_be_an_array():
    rng = np.random.default_rng(0)
    L, E = rng.uniform(1, 2, (3, 1)), rng.uniform(1, 2, 4)
    C = cantilever_compliance(L, E, 1, 1, 1, 1, 1)
    assert C.shape == (3, 4, 6, 6)
    single = cantilever_compliance(float(L[2, 0]), float(E[1]), 1, 1, 1, 1, 1)
    np.testing.assert_array_equal(C[2, 1], single)


def test_integers_give_floats():
    C = cantilever_compliance(2, 3, 1, 1, 1, 1, 1)
    assert C.dtype == np.float64
    assert C[1, 1] == pytest.approx(8 / 9, rel=1e-15)


class SequenceLike:
    """A number that looks like a sequence, as the polynomials of some algebra systems do."""

    def __init__(self, value):
        self.value = value

    def __len__(self):
        return 2

    def __getitem__(self, k):
        return [1, 2][k]

    def _of(self, other):
        return other.value if isinstance(other, SequenceLike) else other

    def __mul__(self, other):
        return SequenceLike(self.value * self._of(other))

    def __truediv__(self, other):
        return SequenceLike(self.value / self._of(other))

    def __neg__(self):
        return SequenceLike(-self.value)

    __rmul__ = __mul__


def test_entries_that_look_like_sequences_stay_whole():
    C = cantilever_compliance(SequenceLike(2.0), 3, 1, 1, 1, 1, 1)
    assert C.shape == (6, 6)
    assert C[1, 5].value == pytest.approx(2 / 3)


STEEL = rs.Material.isotropic("steel", 210e9, 0.3)


def test_telescopic_pieces_broadcast():
    extension = np.array([0.1, 0.2, 0.3])
    batch = tapered_compliance([(0.5, STEEL, rs.circle(0.03)), (extension, STEEL, rs.circle(0.02))])
    assert batch.shape == (3, 6, 6)
    for k, x in enumerate(extension):
        single = tapered_compliance([(0.5, STEEL, rs.circle(0.03)), (x, STEEL, rs.circle(0.02))])
        np.testing.assert_allclose(batch[k], single, rtol=1e-14, atol=0)
    moving_base = tapered_compliance(
        [(extension, STEEL, rs.circle(0.03)), (0.5, STEEL, rs.circle(0.02))]
    )
    assert moving_base.shape == (3, 6, 6)
