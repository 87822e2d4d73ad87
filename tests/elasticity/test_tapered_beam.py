"""Stepped beams: pieces of one beam, and messages; steps of random files: tests/campaign."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import beam_compliance, tapered_compliance
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
