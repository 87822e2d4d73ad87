"""Indices of stiffness: eigenscrews, centres, principal and collinear parts."""
# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis import Stiffness, measures
from robostiff.analysis.indices import (
    Eigenscrews,
    anisotropy,
    centre_of_compliance,
    centre_of_stiffness,
    collinear_stiffness,
    condition_number,
    directional_stiffness,
    eigenscrews,
    eigenstiffness,
    principal_stiffness,
    stiffness_about_axis,
    virtual_work,
    worst_deflection,
)
from robostiff.elasticity import elasticity_from_compliance, elasticity_from_stiffness
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.page import principal_table
from robostiff.spatial import Space, move_compliance, move_stiffness, move_wrench, skew
from tests.cases.metric import distance
from tests.generators.chains import beam_compliance_of, random_rotation, snapshot_of
from tests.generators.robots import strut
from tests.paper.home_matrices import eq27, eq28

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


@given(SEEDS, st.integers(1, 6))
def test_eigenscrews_are_all_of_K(seed: int, number: int):
    result = on_struts(seed, number)
    found = eigenscrews(result)
    assert distance(rebuilt(found, result.reference_point), result.K) <= 1e-6
    held = sum(k.stiffness > 0 for k in (*found.wrenches, *found.twists))
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


LENGTHS = st.floats(0.05, 5.0)


@given(SEEDS)
def test_stiffness_along_a_line_is_what_gauges_measure(seed: int):
    """Whatever the length of the vector that is given; in the plane about z alone."""
    u = np.random.default_rng(seed + 1).normal(size=3)
    for result, n, axis in ((random_body(seed), 3, u), (planar_body(seed), 2, np.array([0, 0, 1]))):
        C, K = result.required_compliance(), result.K
        v = u[:n] / np.linalg.norm(u[:n])
        w = axis[3 - len(K) + n :] / np.linalg.norm(axis)
        for along, unit, part in (
            (directional_stiffness(result, 5 * u[:n]), v, slice(0, n)),
            (stiffness_about_axis(result, -3 * axis), w, slice(n, None)),
        ):
            assert np.isclose(along.free, 1 / (unit @ C[part, part] @ unit), rtol=1e-9)
            assert np.isclose(along.held, unit @ K[part, part] @ unit, rtol=1e-9)


@given(SEEDS, LENGTHS)
def test_indices_of_maps_are_those_of_a_pose(seed: int, length: float):
    result = random_body(seed)
    held, K = principal_stiffness(result), result.K[None]
    of_maps = measures.stiffness_indices(K, np.array([6]), length)
    for value, other in (
        ([*held.translational, *held.rotational], measures.principal_stiffnesses(K)[0]),
        (
            worst_deflection(result).translational,
            measures.worst_deflection(result.required_compliance()[None])[0],
        ),
        (eigenstiffness(result, length=length).values[0], of_maps["smallest_eigenvalue"][0]),
        (condition_number(result, length=length).isotropy, of_maps["isotropy"][0]),
    ):
        np.testing.assert_allclose(other, value, rtol=1e-8)


def test_a_robot_whose_legs_meet():
    """Forces through the apex are met, and what turns about it is not."""
    robot = rs.load("gough-stewart-a")
    result = rs.stiffness(robot)
    across, along = (directional_stiffness(result, u) for u in ([1, 0, 0], [0, 0, 1]))
    assert across.free == 0.0
    assert rs.Status.UNBALANCED in across.status
    assert rs.Status.UNBALANCED not in along.status
    # what a force along z meets is the deflection under it
    assert np.isclose(along.free, 1 / rs.deflection(robot, wrench=[0, 0, 1, 0, 0, 0]).twist[2])
    worst, work, condition = (
        worst_deflection(result),
        virtual_work(result),
        condition_number(result),
    )
    for lacking in (worst.translational, worst.rotational, work.worst, condition.two_norm,
                    condition.frobenius, anisotropy(result).translational):  # fmt: skip
        assert lacking is None
    assert rs.Status.UNBALANCED in worst.status
    assert rs.Status.UNBALANCED in work.status
    assert np.isclose(worst.translational_direction[2], 0.0)
    assert condition.isotropy == 0.0
    apex = result.about(np.array([0.0, 0, 2]))
    held, free = principal_stiffness(apex), collinear_stiffness(apex)
    assert np.array_equal(held.rotational, np.zeros(3))
    assert np.allclose(free.translational, held.translational, rtol=1e-12)
    assert np.all(free.translational > 0)
    assert worst_deflection(apex).translational is not None


@given(SEEDS, SEEDS)
def test_with_inertia_as_metric_no_reference_point_matters(seed: int, other: int):
    """The inertia over the mass of a random body; eigentwists are conjugate in it and in K."""
    result, rng, M = random_body(seed), np.random.default_rng(seed), np.zeros((6, 6))
    for p in rng.uniform(-0.5, 0.5, (8, 3)):
        J = np.hstack([np.eye(3), -skew(p)])  # velocity of a point mass
        M += J.T @ J / 8
    found = eigenstiffness(result, metric=M)
    X = found.twists.T
    assert np.allclose(X.T @ M @ X, np.eye(6), atol=1e-9)
    assert np.allclose(X.T @ result.K @ X, np.diag(found.values), atol=1e-8 * found.values[-1])
    assert found.length is None
    v = np.random.default_rng(other).uniform(-1, 1, 3)
    there = eigenstiffness(result.about(result.reference_point + v), metric=move_stiffness(M, v))
    assert np.allclose(there.values, found.values, rtol=1e-6)


def test_the_length_is_the_robots_own_when_left_out():
    result = rs.stiffness(rs.load("hexapod"))
    assert isinstance(result, rs.Stiffness)
    assert rs.indices(result).length == float(result.length)


def test_far_away_points_do_not_blur_what_does_not_depend_on_them():
    result = rs.stiffness(rs.load("hexapod"))
    near, far = rs.indices(result), rs.indices(result.about(np.array([1e5, 0, 0])))
    assert np.allclose(far.centre_of_stiffness.point, near.centre_of_stiffness.point, atol=1e-9)
    for one, two in zip(near.eigenscrews.twists, far.eigenscrews.twists, strict=True):
        assert np.isclose(one.stiffness, two.stiffness, rtol=1e-12)


def test_a_moment_in_a_plane_is_about_z():
    table = principal_table(rs.indices(rs.stiffness(rs.load("3-rrr"))))
    assert [row[0] for row in table.rows] == ["force along x", "force along y", "moment about z"]


# Robots whose stiffness is known or random, for tests of indices.


def body_on_spring(K: np.ndarray, at: np.ndarray | None = None) -> Stiffness:
    """A platform on one spring of a 6 x 6 stiffness, about its own point."""
    point = np.zeros(3) if at is None else np.asarray(at, dtype=float)
    return _alone(elasticity_from_stiffness(K), point)


def clamped_beam(length: float, turn: np.ndarray) -> tuple[Stiffness, dict[str, float]]:
    """A cantilever from the origin along the first column of `turn`, and its rigidities."""
    E, G, A, Iy, Iz, J = 2e11, 8e10, 4e-4, 2e-8, 5e-8, 3e-8
    rigidities = {"EA": E * A, "GJ": G * J, "EIy": E * Iy, "EIz": E * Iz}
    C = beam_compliance_of(length, **rigidities)
    return _alone(elasticity_from_compliance(C), length * turn[:, 0], turn), rigidities


def random_stiffness(rng: np.random.Generator, size: float = 1e3) -> np.ndarray:
    """A full regular matrix [N/m, N, N m]."""
    A = rng.normal(size=(6, 6))
    scale = np.diag([size] * 3 + [0.3 * size] * 3)
    K = scale @ (A @ A.T + 0.3 * np.eye(6)) @ scale
    return 0.5 * (K + K.T)


def random_body(seed: int) -> Stiffness:
    """A platform on a random full spring, somewhere."""
    rng = np.random.default_rng(seed)
    return body_on_spring(random_stiffness(rng), rng.uniform(-1, 1, 3))


def on_struts(seed: int, number: int) -> Stiffness:
    """A platform on struts between balls: of rank `number` up to six."""
    rng = np.random.default_rng(seed)
    legs = [
        strut(rng, rng.uniform(-1, 1, 3) - [0, 0, 2], rng.uniform(-1, 1, 3)) for _ in range(number)
    ]
    return rs.stiffness(snapshot_of(legs, rng.uniform(-0.5, 0.5, 3)))


def planar_body(seed: int) -> Stiffness:
    """A planar platform on a random spring."""
    rng = np.random.default_rng(seed)
    K = random_stiffness(rng)
    inside, outside = [0, 1, 5], [2, 3, 4]
    K[np.ix_(inside, outside)] = 0.0
    K[np.ix_(outside, inside)] = 0.0
    point = np.append(rng.uniform(-1, 1, 2), 0.0)
    return _alone(elasticity_from_stiffness(K), point, space=Space.PLANAR)


def any_rotation(seed: int) -> np.ndarray:
    return random_rotation(np.random.default_rng(seed))


def _alone(elasticity, point, rotation=None, space=Space.SPATIAL) -> Stiffness:
    axes = np.eye(3) if rotation is None else rotation
    leg = PlacedLeg("leg", (PlacedSpring("spring", point, axes, elasticity),), point)
    return rs.stiffness(Snapshot("body", (leg,), point, space))
