"""Statuses, metrics, maps and laws of indices; their definitions are in tests/campaign."""

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis import measures
from robostiff.analysis.indices import (
    anisotropy,
    collinear_stiffness,
    condition_number,
    directional_stiffness,
    eigenstiffness,
    principal_stiffness,
    stiffness_about_axis,
    virtual_work,
    worst_deflection,
)
from robostiff.page import principal_table
from robostiff.spatial import Screw, move_stiffness, skew
from tests.analysis.indices.machines import any_rotation, planar_body, random_body, turned_body

# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false


SEEDS = st.integers(0, 2**32 - 1)
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


def numbers_of(found: Any) -> np.ndarray:
    """Those that belong to the machine, whatever its axes."""
    eigenscrews = (*found.eigenscrews.wrenches, *found.eigenscrews.twists)
    own = [*found.principal.translational, *found.collinear.rotational]
    own += [one.stiffness for one in eigenscrews]
    return np.array([*own, found.centre_of_stiffness.coupling, found.centre_of_compliance.coupling])


@given(SEEDS, SEEDS)
def test_axes_do_not_matter_and_places_turn_with_the_robot(seed: int, other: int):
    R = any_rotation(other)
    here, there = map(rs.indices, (random_body(seed), turned_body(seed, R)))
    np.testing.assert_allclose(numbers_of(there), numbers_of(here), rtol=1e-6)
    u = np.random.default_rng(seed).normal(size=3)
    along, turned = (
        directional_stiffness(here.result, u),
        directional_stiffness(there.result, R @ u),
    )
    assert np.isclose(along.free, turned.free, rtol=1e-7)
    for name in ("centre_of_stiffness", "centre_of_compliance"):
        centre, moved = getattr(here, name), getattr(there, name)
        np.testing.assert_allclose(moved.point, R @ centre.point, atol=1e-7)
    for one, two in zip(screws_of(here), screws_of(there), strict=True):
        assert np.isclose(one.pitch, two.pitch, atol=1e-6)
        # lines: the moment of the direction about the origin turns with the rest
        moment, sign = R @ np.cross(one.point, one.axis), np.sign(two.axis @ R @ one.axis)
        np.testing.assert_allclose(np.cross(two.point, two.axis), sign * moment, atol=1e-6)


def screws_of(found: Any) -> list[Screw]:
    return [own.screw for own in (*found.eigenscrews.wrenches, *found.eigenscrews.twists)]


@given(SEEDS, SEEDS)
def test_what_depends_on_the_reference_point_and_what_does_not(seed: int, other: int):
    result = random_body(seed)
    away = result.reference_point + np.random.default_rng(other).uniform(1, 2, 3)
    here, there = rs.indices(result), rs.indices(result.about(away))
    np.testing.assert_allclose(numbers_of(there), numbers_of(here), rtol=1e-7)
    for name in ("centre_of_stiffness", "centre_of_compliance"):
        np.testing.assert_allclose(getattr(there, name).point, getattr(here, name).point, atol=1e-8)
    for one, two in zip(screws_of(here), screws_of(there), strict=True):
        np.testing.assert_allclose(one.point, two.point, atol=1e-7)
    assert not np.allclose(here.principal.rotational, there.principal.rotational, rtol=1e-3)
    assert not np.allclose(here.collinear.translational, there.collinear.translational, rtol=1e-3)
