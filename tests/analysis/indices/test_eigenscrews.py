"""Eigenscrews are all of K and belong to the machine; about its centres coupling is symmetric."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis.indices import (
    Eigenscrews,
    centre_of_compliance,
    centre_of_stiffness,
    eigenscrews,
)
from robostiff.spatial import move_compliance, move_stiffness, move_wrench
from tests.analysis.indices.machines import (
    any_rotation,
    body_on_spring,
    clamped_beam,
    on_struts,
    planar_body,
    random_body,
)
from tests.cases.metric import distance
from tests.paper.home_matrices import eq27, eq28

# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false


SEEDS = st.integers(0, 2**32 - 1)


def rebuilt(found: Eigenscrews, reference: np.ndarray) -> np.ndarray:
    """The sum of k w w^T over eigenwrenches, and over the couples of eigentwists."""
    K = np.zeros((6, 6))
    for wrench in found.wrenches:
        if wrench.screw is not None and wrench.screw.point is not None:
            f = wrench.screw.axis
            w = np.concatenate([f, (wrench.screw.pitch or 0.0) * f])
            w = move_wrench(w, reference - wrench.screw.point)
            K += wrench.stiffness * np.outer(w, w)
    for twist in found.twists:
        couple = np.concatenate([np.zeros(3), twist.direction])
        K += twist.stiffness * np.outer(couple, couple)
    return K


def all_of(found: Eigenscrews) -> tuple:
    return (*found.wrenches, *found.twists)


@given(SEEDS, st.integers(1, 6))
def test_eigenscrews_are_all_of_K(seed: int, number: int):
    result = on_struts(seed, number)
    found = eigenscrews(result)
    assert distance(rebuilt(found, result.reference_point), result.K) <= 1e-6
    held = sum(k.stiffness > 0 for k in all_of(found))
    assert held == int(result.rank) == number


@given(SEEDS)
def test_an_eigenwrench_displaces_along_itself_without_turning(seed: int):
    result = random_body(seed)
    for wrench in eigenscrews(result).wrenches:
        f = wrench.screw.axis
        w = np.concatenate([f, wrench.screw.pitch * f])
        w = move_wrench(w, result.reference_point - wrench.screw.point)
        twist = result.required_compliance() @ w
        assert np.allclose(twist[:3], f / wrench.stiffness, atol=1e-6 / wrench.stiffness)
        assert np.allclose(twist[3:], 0.0, atol=1e-6 / wrench.stiffness)


@given(SEEDS)
def test_a_couple_of_an_eigentwist_turns_about_itself(seed: int):
    result = random_body(seed)
    for found in eigenscrews(result).twists:
        twist = result.required_compliance() @ np.concatenate([np.zeros(3), found.direction])
        assert np.allclose(twist[3:] * found.stiffness, found.direction, atol=1e-6)
        r = result.reference_point - found.screw.point
        shift = np.cross(found.direction, r) + found.screw.pitch * found.direction
        assert np.allclose(twist[:3] * found.stiffness, shift, atol=1e-6)


@given(SEEDS)
def test_a_beam_has_three_compliant_axes_through_its_middle(seed: int):
    R = any_rotation(seed)
    result, beam = clamped_beam(0.8, R)
    L = 0.8
    axes = sorted(eigenscrews(result).compliant_axes, key=lambda a: a.translational)
    assert len(axes) == 3
    # pushing along z bends about y, so the axes along z and y exchange their rigidities
    expected = [
        (12 * beam["EIy"] / L**3, beam["EIz"] / L),
        (12 * beam["EIz"] / L**3, beam["EIy"] / L),
        (beam["EA"] / L, beam["GJ"] / L),
    ]
    found = [(axis.translational, axis.rotational) for axis in axes]
    assert np.allclose(found, expected, rtol=1e-9, atol=0)
    for axis in axes:
        off = np.cross(axis.direction, axis.point - 0.5 * L * R[:, 0])
        assert np.linalg.norm(off) < 1e-9


def test_a_general_body_has_no_compliant_axis():
    assert eigenscrews(random_body(1)).compliant_axes == ()


@given(SEEDS)
def test_in_the_plane_all_axes_meet_in_the_elastic_centre(seed: int):
    result = planar_body(seed)
    found = eigenscrews(result)
    assert (len(found.wrenches), len(found.twists)) == (2, 1)
    centre = found.twists[0].screw.point
    for wrench in found.wrenches:
        assert wrench.screw.pitch == 0.0
        assert np.linalg.norm(np.cross(wrench.screw.axis, centre - wrench.screw.point)) < 1e-7


def test_what_is_free_has_stiffness_zero():
    found = eigenscrews(rs.stiffness(rs.load("gough-stewart-a")))
    assert [twist.stiffness for twist in found.twists] == [0.0, 0.0, 0.0]
    assert all(wrench.stiffness > 0 for wrench in found.wrenches)
    # all legs meet in the apex: so do the axes
    for screw in (wrench.screw for wrench in found.wrenches):
        assert np.linalg.norm(np.cross(screw.axis, [0, 0, 2] - screw.point)) < 1e-9
    assert found.compliant_axes == ()
    assert rs.Status.FREE_MOTIONS in found.status


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_free_translation_has_no_wrench(lost: int):
    stiffnesses = np.array([1e5, 2e5, 3e5, 400.0, 500.0, 600.0])
    stiffnesses[lost] = 0.0
    found = eigenscrews(body_on_spring(np.diag(stiffnesses), [0.1, 0.2, 0.3]))
    assert found.wrenches[0].stiffness == 0.0
    assert found.wrenches[0].screw is None
    assert np.array_equal(np.abs(found.wrenches[0].direction), np.eye(3)[lost])
    assert [round(twist.stiffness) for twist in found.twists] == [400, 500, 600]


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
