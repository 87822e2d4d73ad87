"""Stepped beams: pieces of one beam, a cone against its integrals, order and messages."""

import math

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import BeamSegment, beam_compliance, tapered_compliance
from robostiff.errors import InputError

THEORIES = [rs.EulerBernoulli(), rs.Timoshenko()]
STEEL = rs.Material.isotropic("steel", 210e9, 0.3)
ODD = rs.CrossSection(
    A=1.3e-3, Iy=2.1e-7, Iz=5.5e-7, J=3.7e-7, shear_factor_y=0.81, shear_factor_z=0.43
)


@pytest.mark.parametrize("theory", THEORIES)
def test_unequal_pieces_make_the_whole(theory):
    lengths = np.array([0.05, 0.4, 0.01, 0.3])
    whole = beam_compliance(lengths.sum(), STEEL, ODD, theory)
    pieces = tapered_compliance([(L, STEEL, ODD) for L in lengths], theory)
    np.testing.assert_allclose(pieces, whole, rtol=1e-13, atol=0)


def cone(n, L, d0, d1):
    middle = d0 + (d1 - d0) * (np.arange(n) + 0.5) / n
    return [BeamSegment(L / n, STEEL, rs.circle(float(d))) for d in middle]


def cone_exactly(L, d0, d1):
    """Tip compliance of a slender cone, clamped at diameter d0, free at d1, integrated by hand.

    With d(x) linear and a = L - x: integral of a^2/I is 64 L^3/(3 pi d0^3 d1), the deflection
    given by Gere and Timoshenko, Mechanics of Materials, 4th ed., example 9-13 (d0 = 2 d1);
    integral of 1/A is 4L/(pi d0 d1).
    """
    E, G = STEEL.E, STEEL.G
    c = (d0 - d1) / L
    # a runs from the tip: d = d1 + c a.
    sum0 = (d1**-3 - d0**-3) / (3 * c)
    sum1 = ((d1**-2 - d0**-2) / 2 - d1 * (d1**-3 - d0**-3) / 3) / c**2
    sum2 = L**3 / (3 * d0**3 * d1)
    to_inertia = 64 / math.pi
    C = np.zeros((6, 6))
    C[0, 0] = 4 * L / (math.pi * E * d0 * d1)
    C[3, 3] = to_inertia / 2 * sum0 / G
    C[4, 4] = C[5, 5] = to_inertia * sum0 / E
    C[1, 1] = C[2, 2] = to_inertia * sum2 / E
    C[1, 5] = C[5, 1] = to_inertia * sum1 / E
    C[2, 4] = C[4, 2] = -to_inertia * sum1 / E
    return C


@pytest.mark.parametrize(("d0", "d1"), [(0.06, 0.03), (0.03, 0.06)])
def test_a_cone_converges_with_the_square_of_the_number_of_pieces(d0, d1):
    exact = cone_exactly(0.7, d0, d1)
    there = exact != 0
    errors = []
    for n in (20, 40, 80):
        C = tapered_compliance(cone(n, 0.7, d0, d1))
        assert (C[~there] == 0).all()
        errors.append(np.abs(C[there] / exact[there] - 1).max())
    assert errors[2] < 1e-3
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4, rtol=0.02)


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


def test_timoshenko_needs_the_factors_of_every_segment():
    bare = rs.CrossSection(1e-3, 1e-7, 1e-7, 2e-7)
    with pytest.raises(InputError, match="shear correction factors"):
        tapered_compliance([(0.1, STEEL, ODD), (0.1, STEEL, bare)], rs.Timoshenko())
