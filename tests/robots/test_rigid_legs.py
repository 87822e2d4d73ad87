"""Rigid legs that can move: what they guide is rigid, and what is left is as soft as the others."""

from typing import Any

import numpy as np
import pytest

import robostiff as rs
from tests.files import FILES


@pytest.fixture
def tricept() -> Any:
    return rs.load(FILES / "guided-by-a-rigid-leg.yaml")


def test_a_rigid_rocker_leaves_the_compliance_of_the_crank():
    """The crank of 1 m, on 1e4 N m/rad, gives way along y alone, as of the linkage."""
    crank = FILES / "crank.xml"
    found = rs.stiffness(rs.load(crank))
    C = np.zeros((6, 6))
    C[1, 1] = 1e-4
    assert found.status == rs.Status.RIGID_DIRECTION
    np.testing.assert_allclose(rs.compliance(rs.load(crank)), C, rtol=0, atol=1e-18)
    np.testing.assert_allclose(rs.compliance(rs.load_linkage(crank)), C, rtol=0, atol=1e-18)


def test_a_rigid_guide_leaves_the_compliance_of_the_struts(tricept: rs.Robot):
    """Three struts of 1e8 N/m at c = h / L to the vertical: C_zz = 1 / (3 k c^2)."""
    found = rs.stiffness(tricept)
    assert found.status == rs.Status.RIGID_DIRECTION
    slope = 1 / (0.3**2 + 1)
    assert found.compliance is not None
    assert found.compliance[2, 2] == pytest.approx(1 / (3 * 1e8 * slope), rel=1e-12)
    assert not np.any(found.compliance[5])  # the guide does not let it turn about itself
    C = rs.deflection(tricept, wrench=np.array([0, 0, 100.0, 0, 0, 0])).twist
    assert C[2] == pytest.approx(100 * found.compliance[2, 2], rel=1e-12)


def test_at_many_poses_and_once_a_record_would_pay_the_answer_is_the_same(tricept: rs.Robot):
    pose = [0.05, -0.02, 1.02]
    many = rs.stiffness(tricept, np.tile(pose, (30, 1)))
    assert set(many.status_codes.tolist()) == {int(rs.Status.RIGID_DIRECTION)}
    C = rs.compliance(tricept, pose)
    for _ in range(25):
        last = rs.stiffness(tricept, pose).compliance
        assert last is not None
        np.testing.assert_allclose(last, C, rtol=1e-12, atol=1e-22)
