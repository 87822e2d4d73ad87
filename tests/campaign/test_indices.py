"""Stiffness indices of random bodies, against their definitions in 60 digits."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis.indices import eigenstiffness, principal_stiffness
from robostiff.elasticity import elasticity_from_stiffness
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from tests.campaign.indices import KINDS, body, compare


@pytest.mark.parametrize("seed", range(len(KINDS)))
@pytest.mark.parametrize("length", [None, 0.4])
def test_indices_are_those_of_their_definitions(seed, length):
    assert compare(body(seed + (8 if length else 0)), length=length) == []


def test_soft_directions_beside_a_stiff_one_are_those_of_their_own():
    """Springs of 1 and 5 N/m at 30 degrees, beside one of 1e10 N/m, are not alike."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    K = np.diag([0.0, 0.0, 1e10, 1e3, 2e3, 3e3])
    K[:2, :2] = np.array([[c, -s], [s, c]]) @ np.diag([1.0, 5.0]) @ np.array([[c, s], [-s, c]])
    leg = PlacedLeg(
        "leg",
        (PlacedSpring("spring", np.zeros(3), np.eye(3), elasticity_from_stiffness(K)),),
        np.zeros(3),
    )
    result = rs.stiffness(Snapshot("body", (leg,), np.zeros(3)))
    for found in (principal_stiffness(result), rs.indices(result).collinear):
        np.testing.assert_allclose(found.translational_directions[0], [c, s, 0], atol=1e-5)
        np.testing.assert_allclose(found.translational[:2], [1, 5], rtol=1e-4)
    modes = eigenstiffness(result, length=1.0)
    np.testing.assert_allclose(np.abs(modes.twists[0]), [c, s, 0, 0, 0, 0], atol=1e-5)
    assert not np.any(np.abs(rs.indices(result).worst_deflection.translational_direction[2]) > 1e-5)
