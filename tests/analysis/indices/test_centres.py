"""Centres of stiffness and of compliance: where coupling blocks are symmetric."""

# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis.indices import centre_of_compliance, centre_of_stiffness, eigenscrews
from robostiff.spatial import move_compliance, move_stiffness
from tests.analysis.indices.machines import (
    any_rotation,
    body_on_spring,
    clamped_beam,
    on_struts,
    planar_body,
    random_body,
)
from tests.paper.home_matrices import eq27, eq28

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
def test_coupling_is_symmetric_about_the_centres(seed: int):
    result = random_body(seed)
    stiffness, compliance = centre_of_stiffness(result), centre_of_compliance(result)
    K = move_stiffness(result.K, stiffness.point - result.reference_point)
    B = K[:3, 3:]
    assert np.allclose(B, B.T, atol=1e-7 * np.abs(K[:3, :3]).max())
    assert np.allclose(stiffness.matrix, K, rtol=1e-6, atol=1e-6 * np.abs(K).max())
    C = move_compliance(result.required_compliance(), compliance.point - result.reference_point)
    F = C[:3, 3:]
    assert np.allclose(F, F.T, atol=1e-7 * np.abs(C[3:, 3:]).max())
    assert 0 < stiffness.coupling < 1
    assert 0 < compliance.coupling < 1


@given(SEEDS)
def test_axes_of_eigenscrews_balance_about_the_centres(seed: int):
    result = random_body(seed)
    found = eigenscrews(result)

    def lever(screw, centre):
        r = screw.point - centre
        return r - (r @ screw.axis) * screw.axis

    centre = centre_of_stiffness(result).point
    levers = [w.stiffness * lever(w.screw, centre) for w in found.wrenches]
    assert np.allclose(sum(levers), 0.0, atol=1e-6 * np.abs(levers).max())
    centre = centre_of_compliance(result).point
    levers = [lever(t.screw, centre) / t.stiffness for t in found.twists]
    assert np.allclose(sum(levers), 0.0, atol=1e-6 * np.abs(levers).max())


@given(SEEDS, st.floats(0.1, 3.0))
def test_centre_of_a_cantilever_is_its_middle(seed: int, length: float):
    R = any_rotation(seed)
    result, _ = clamped_beam(length, R)
    for centre in (centre_of_stiffness(result), centre_of_compliance(result)):
        assert np.allclose(centre.point, 0.5 * length * R[:, 0], atol=1e-8 * length)
        assert centre.is_decoupled


@given(SEEDS)
def test_in_the_plane_both_centres_are_one_and_decouple(seed: int):
    result = planar_body(seed)
    stiffness, compliance = centre_of_stiffness(result), centre_of_compliance(result)
    assert np.allclose(stiffness.point, compliance.point, atol=1e-8)
    assert stiffness.is_decoupled
    assert compliance.is_decoupled


@pytest.mark.parametrize(("R", "r", "h"), [(0.5, 0.3, 0.8), (0.7, 0.2, 0.5), (0.4, 0.3, 1.0)])
def test_centre_of_the_platforms_of_the_paper(R: float, r: float, h: float):
    sizes = {"R": f"{R} m", "r": f"{r} m", "h": f"{h} m"}
    # (27): the legs meet in the apex, h R / (R - r) above the base
    a = centre_of_stiffness(rs.stiffness(rs.load("gough-stewart-a", sizes), [0, 0, h, 0, 0, 0]))
    K = eq27(1.0, R, r, h)
    assert np.allclose(a.point, [0, 0, h + K[0, 4] / K[0, 0]], atol=1e-9)
    assert np.allclose(a.point, [0, 0, h * R / (R - r)], atol=1e-9)
    assert a.coupling == 0.0
    # (28): K_15 / K_11 above the platform
    b = centre_of_stiffness(rs.stiffness(rs.load("gough-stewart-b", sizes), [0, 0, h, 0, 0, 0]))
    K = eq28(1.0, R, r, h)
    assert np.allclose(b.point, [0, 0, h + K[0, 4] / K[0, 0]], atol=1e-9)


def test_forces_of_one_direction_have_a_line_of_centres():
    result = on_struts(5, 1)
    centre = centre_of_stiffness(result)
    wrench = next(w for w in eigenscrews(result).wrenches if w.stiffness > 0)
    assert np.isclose(abs(centre.line @ wrench.direction), 1.0)
    off = np.cross(wrench.direction, centre.point - wrench.screw.point)
    assert np.linalg.norm(off) < 1e-9


def test_without_forces_there_is_no_centre_of_stiffness():
    centre = centre_of_stiffness(body_on_spring(np.diag([0, 0, 0, 10.0, 20.0, 30.0])))
    assert centre.point is None
    assert centre.coupling is None
    assert not centre.is_decoupled


def test_without_compliance_there_is_no_centre_of_it():
    centre = centre_of_compliance(rs.stiffness(rs.load("gough-stewart-a")))
    assert centre.point is None
    assert rs.Status.FREE_MOTIONS in centre.status
