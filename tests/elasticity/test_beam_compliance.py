"""Beams: textbook deflections, closed-form inverse, batches, messages."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import beam_compliance, beam_stiffness
from tests.generators.chains import beam_compliance_of, rigidities

THEORIES = [rs.EulerBernoulli(), rs.Timoshenko()]
ALUMINIUM = rs.Material("aluminium", E=70e9, G=26e9)
# All six numbers and both shear factors differ: an exchange of axes cannot hide.
ODD = rs.CrossSection(
    A=1.3e-3, Iy=2.1e-7, Iz=5.5e-7, J=3.7e-7, shear_factor_y=0.81, shear_factor_z=0.43
)


@pytest.mark.parametrize("theory", THEORIES)
@pytest.mark.parametrize("L", [0.03, 0.4, 7.0])
def test_compliance_is_that_of_the_textbooks(L, theory):
    C = beam_compliance(L, ALUMINIUM, ODD, theory)
    expected = beam_compliance_of(L, *rigidities(ALUMINIUM, ODD, theory))
    np.testing.assert_allclose(C, expected, rtol=1e-12, atol=0)


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
