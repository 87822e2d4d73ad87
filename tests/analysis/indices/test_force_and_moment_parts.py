"""Principal, collinear and directional stiffness, worst deflection and anisotropy."""

# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis import measures
from robostiff.analysis.indices import (
    anisotropy,
    collinear_stiffness,
    directional_stiffness,
    principal_stiffness,
    stiffness_about_axis,
    worst_deflection,
)
from tests.analysis.indices.machines import (
    body_on_spring,
    clamped_beam,
    on_struts,
    planar_body,
    random_body,
)

SEEDS = st.integers(0, 2**32 - 1)


def test_a_cantilever_pushed_at_its_tip():
    L = 0.8
    result, beam = clamped_beam(L, np.eye(3))
    held, free = principal_stiffness(result), collinear_stiffness(result)
    EA, GJ, EIy, EIz = beam["EA"], beam["GJ"], beam["EIy"], beam["EIz"]
    assert np.allclose(held.translational, [12 * EIy / L**3, 12 * EIz / L**3, EA / L])
    assert np.allclose(free.translational, [3 * EIy / L**3, 3 * EIz / L**3, EA / L])
    assert np.allclose(np.sort(held.rotational), np.sort([GJ / L, 4 * EIy / L, 4 * EIz / L]))
    assert np.allclose(np.sort(free.rotational), np.sort([GJ / L, EIy / L, EIz / L]))
    worst = worst_deflection(result)
    assert np.isclose(worst.translational, L**3 / (3 * EIy))
    assert np.allclose(worst.translational_direction, [0, 0, 1])


@given(SEEDS)
def test_free_is_never_stiffer_than_held(seed: int):
    result = random_body(seed)
    held, free = principal_stiffness(result), collinear_stiffness(result)
    assert np.all(free.translational <= held.translational * (1 + 1e-9))
    assert np.all(free.rotational <= held.rotational * (1 + 1e-9))
    u = np.random.default_rng(seed).normal(size=3)
    for along in (directional_stiffness(result, u), stiffness_about_axis(result, u)):
        assert along.free <= along.held * (1 + 1e-9)


@given(SEEDS, st.integers(1, 6))
def test_collinear_loads_move_along_themselves(seed: int, number: int):
    result = on_struts(seed, number)
    free = collinear_stiffness(result)
    K = result.K
    for k, u in zip(free.translational, free.translational_directions, strict=True):
        # some rotation goes with the displacement u so that only the force k u remains
        turn = np.linalg.lstsq(K[3:, 3:], -K[3:, :3] @ u, rcond=1e-9)[0]
        wrench = K @ np.concatenate([u, turn])
        assert np.allclose(wrench[:3], k * u, atol=1e-6 * np.abs(K).max())
        assert np.allclose(wrench[3:], 0.0, atol=1e-6 * np.abs(K).max())
    for k, w in zip(free.rotational, free.rotational_directions, strict=True):
        shift = np.linalg.lstsq(K[:3, :3], -K[:3, 3:] @ w, rcond=1e-9)[0]
        wrench = K @ np.concatenate([shift, w])
        assert np.allclose(wrench[3:], k * w, atol=1e-6 * np.abs(K).max())


@given(SEEDS)
def test_zeros_of_collinear_stiffness_count_the_free_motions(seed: int):
    result = on_struts(seed, 5)
    free = collinear_stiffness(result)
    # one free motion, a screw in general: it shifts the point and it turns
    assert np.count_nonzero(free.translational == 0) == 1
    assert np.count_nonzero(free.rotational == 0) == 1
    twist = result.free_motions[0].twist
    for direction, part in (
        (free.translational_directions[0], twist[:3]),
        (free.rotational_directions[0], twist[3:]),
    ):
        assert np.isclose(abs(direction @ part), np.linalg.norm(part), rtol=1e-7)


@given(SEEDS)
def test_worst_deflection_is_worst_and_that_of_maps(seed: int):
    result = random_body(seed)
    worst, C = worst_deflection(result), result.required_compliance()
    u = worst.translational_direction
    assert np.isclose(np.linalg.norm(C[:3, :3] @ u), worst.translational)
    w = worst.rotational_direction
    assert np.isclose(np.linalg.norm(C[3:, 3:] @ w), worst.rotational)
    others = np.random.default_rng(seed).normal(size=(3, 50))
    others /= np.linalg.norm(others, axis=0)
    assert np.linalg.norm(C[:3, :3] @ others, axis=0).max() <= worst.translational * (1 + 1e-12)
    assert np.isclose(worst.translational, 1 / collinear_stiffness(result).smallest)
    assert np.isclose(worst.translational, measures.worst_deflection(C[None])[0], rtol=1e-10)
    held = principal_stiffness(result)
    of_maps = measures.principal_stiffnesses(result.K[None])[0]
    assert np.allclose([*held.translational, *held.rotational], of_maps, rtol=1e-9)


@given(SEEDS)
def test_directional_stiffness_is_what_gauges_measure(seed: int):
    result = random_body(seed)
    u = np.random.default_rng(seed + 1).normal(size=3)
    u /= np.linalg.norm(u)
    C, K = result.required_compliance(), result.K
    along, about = directional_stiffness(result, 5 * u), stiffness_about_axis(result, 5 * u)
    assert np.isclose(along.free, 1 / (u @ C[:3, :3] @ u), rtol=1e-9)
    assert np.isclose(along.held, u @ K[:3, :3] @ u, rtol=1e-9)
    assert np.isclose(about.free, 1 / (u @ C[3:, 3:] @ u), rtol=1e-9)
    assert np.isclose(about.held, u @ K[3:, 3:] @ u, rtol=1e-9)


def test_a_force_that_drives_a_free_motion_meets_no_stiffness():
    result = rs.stiffness(rs.load("gough-stewart-a"))
    across, along = (directional_stiffness(result, u) for u in ([1, 0, 0], [0, 0, 1]))
    assert across.free == 0.0
    assert rs.Status.UNBALANCED in across.status
    assert rs.Status.UNBALANCED not in along.status
    # what a force along z meets is the deflection under it
    bent = rs.deflection(rs.load("gough-stewart-a"), wrench=[0, 0, 1, 0, 0, 0])
    assert np.isclose(along.free, 1 / bent.twist[2])


def test_about_the_apex_all_forces_are_met_and_no_moment_is():
    result = rs.stiffness(rs.load("gough-stewart-a")).about(np.array([0.0, 0, 2]))
    held, free = principal_stiffness(result), collinear_stiffness(result)
    assert np.array_equal(held.rotational, np.zeros(3))
    assert np.allclose(free.translational, held.translational, rtol=1e-12)
    assert np.all(free.translational > 0)
    assert worst_deflection(result).translational is not None


def test_worst_deflection_without_bound_is_none_and_says_so():
    worst = worst_deflection(rs.stiffness(rs.load("gough-stewart-a")))
    assert worst.translational is None
    assert worst.rotational is None
    assert rs.Status.UNBALANCED in worst.status
    assert np.isclose(worst.translational_direction[2], 0.0)


def test_anisotropy_of_a_diagonal_spring():
    found = anisotropy(body_on_spring(np.diag([1e5, 2e5, 4e5, 30.0, 60.0, 30.0])))
    assert np.isclose(found.translational, 4.0)
    assert np.isclose(found.rotational, 2.0)
    assert anisotropy(rs.stiffness(rs.load("gough-stewart-a"))).translational is None


@given(SEEDS)
def test_planar_parts(seed: int):
    result = planar_body(seed)
    C = result.required_compliance()
    free = collinear_stiffness(result)
    assert np.allclose(1 / free.translational[::-1], np.linalg.eigvalsh(C[:2, :2]), rtol=1e-9)
    assert np.isclose(1 / free.rotational[0], C[2, 2], rtol=1e-9)
    assert np.isclose(directional_stiffness(result, [0, 2]).free, 1 / C[1, 1])
    assert np.isclose(stiffness_about_axis(result, [0, 0, -3]).free, 1 / C[2, 2])
    assert anisotropy(result).rotational == 1.0
