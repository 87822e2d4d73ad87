"""All indices of a pose at once."""

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis.indices import directional_stiffness
from robostiff.page import principal_table
from robostiff.spatial import Screw
from tests.analysis.indices.machines import any_rotation, random_body, turned_body

SEEDS = st.integers(0, 2**32 - 1)


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


@given(SEEDS, SEEDS, st.floats(0.05, 5.0))
def test_axes_do_not_matter_and_places_turn_with_the_robot(seed: int, other: int, length: float):
    R = any_rotation(other)
    here, there = (
        rs.indices(one, length=length) for one in (random_body(seed), turned_body(seed, R))
    )
    np.testing.assert_allclose(numbers_of(there), numbers_of(here), rtol=1e-6)
    for ask in (
        lambda one: one.principal.rotational,
        lambda one: one.collinear.translational,
        lambda one: one.anisotropy.translational,
        lambda one: one.eigenstiffness.values,
        lambda one: (one.condition.two_norm, one.condition.frobenius),
        lambda one: (one.virtual_work.worst, one.virtual_work.mean),
    ):
        np.testing.assert_allclose(ask(there), ask(here), rtol=1e-7)
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
