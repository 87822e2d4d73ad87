"""Eigenvalues in a metric, condition numbers and virtual work: with a length, and what it does."""

# What a regular robot has is optional for others: a None fails these tests by itself.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportOptionalOperand=false, reportCallIssue=false, reportOptionalSubscript=false
# pyright: reportOperatorIssue=false

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff.analysis import measures
from robostiff.analysis.indices import condition_number, eigenstiffness, virtual_work
from robostiff.spatial import move_stiffness, skew
from tests.analysis.indices.machines import body_on_spring, on_struts, random_body

SEEDS = st.integers(0, 2**32 - 1)
LENGTHS = st.floats(0.05, 5.0)


def inertia_over_mass(seed: int) -> np.ndarray:
    """Of a random body, about its reference point: a metric of twists."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (8, 3))
    M = np.zeros((6, 6))
    for p in points:
        J = np.hstack([np.eye(3), -skew(p)])  # velocity of a point mass
        M += J.T @ J / len(points)
    return M


@given(SEEDS, LENGTHS)
def test_eigenvalues_are_those_of_the_scaled_matrix(seed: int, length: float):
    result = random_body(seed)
    found = eigenstiffness(result, length=length)
    s = np.array([1, 1, 1, length, length, length])
    assert np.allclose(found.values, np.linalg.eigvalsh(result.K / np.outer(s, s)), rtol=1e-8)
    of_maps = measures.stiffness_indices(result.K[None], np.array([6]), length)
    assert np.isclose(found.values[0], of_maps["smallest_eigenvalue"][0], rtol=1e-8)
    assert np.isclose(
        condition_number(result, length=length).isotropy, of_maps["isotropy"][0], rtol=1e-8
    )
    assert np.allclose(np.linalg.norm(found.twists * s, axis=1), 1.0)


@given(SEEDS)
def test_eigentwists_of_a_metric_are_conjugate(seed: int):
    result, M = random_body(seed), inertia_over_mass(seed)
    found = eigenstiffness(result, metric=M)
    X = found.twists.T
    assert np.allclose(X.T @ M @ X, np.eye(6), atol=1e-9)
    assert np.allclose(X.T @ result.K @ X, np.diag(found.values), atol=1e-8 * found.values[-1])
    assert found.length is None


@given(SEEDS, SEEDS)
def test_with_inertia_as_metric_no_reference_point_matters(seed: int, other: int):
    result, M = random_body(seed), inertia_over_mass(seed)
    v = np.random.default_rng(other).uniform(-1, 1, 3)
    there = eigenstiffness(result.about(result.reference_point + v), metric=move_stiffness(M, v))
    assert np.allclose(there.values, eigenstiffness(result, metric=M).values, rtol=1e-6)


@given(SEEDS, LENGTHS, st.sampled_from([1e3, 1e-3, 1 / 0.0254]))
def test_the_unit_of_length_does_not_matter(seed: int, length: float, per_metre: float):
    """A machine `per_metre` times as large in a unit as much larger is the same machine."""
    result = random_body(seed)
    s = np.array([1.0] * 3 + [per_metre] * 3)
    scaled = body_on_spring(result.K * np.outer(s, s) / per_metre**2)
    one = condition_number(result, length=length)
    two = condition_number(scaled, length=per_metre * length)
    assert np.isclose(one.two_norm, two.two_norm, rtol=1e-8)
    assert np.isclose(one.frobenius, two.frobenius, rtol=1e-8)
    # forces in N, lengths in the other unit: stiffness per length
    values = eigenstiffness(scaled, length=per_metre * length).values
    assert np.allclose(
        values * per_metre**2, eigenstiffness(result, length=length).values, rtol=1e-8
    )


def test_an_isotropic_spring_has_condition_one_at_its_length():
    k, L = 1e5, 0.2
    result = body_on_spring(np.diag([k, k, k, k * L**2, k * L**2, k * L**2]))
    found = condition_number(result, length=L)
    assert np.isclose(found.two_norm, 1.0)
    assert np.isclose(found.frobenius, 1.0)
    assert np.isclose(condition_number(result, length=2 * L).two_norm, 4.0)
    work = virtual_work(result, length=L)
    assert np.isclose(work.worst, 0.5 / k)
    assert np.isclose(work.mean, 0.5 / k)


@given(SEEDS, LENGTHS)
def test_virtual_work_is_the_energy_of_its_load(seed: int, length: float):
    result = random_body(seed)
    found = virtual_work(result, length=length)
    C = result.required_compliance()
    F = found.worst_wrench
    assert np.isclose(np.linalg.norm(F / [1, 1, 1, length, length, length]), 1.0)
    assert np.isclose(0.5 * F @ C @ F, found.worst, rtol=1e-9)
    loads = np.random.default_rng(seed).normal(size=(6, 20000))
    loads /= np.linalg.norm(loads, axis=0)
    loads[3:] *= length
    works = 0.5 * np.einsum("im,ij,jm->m", loads, C, loads)
    assert works.max() <= found.worst * (1 + 1e-9)
    spread = works.std() / np.sqrt(works.size)
    assert abs(works.mean() - found.mean) <= 6 * spread


def test_virtual_work_is_what_deflection_stores():
    robot = rs.load("hexapod")
    found = virtual_work(rs.stiffness(robot), length=0.3)
    assert np.isclose(rs.deflection(robot, wrench=found.worst_wrench).energy, found.worst)


@given(SEEDS, st.integers(1, 5))
def test_free_motions_have_eigenvalue_zero(seed: int, number: int):
    result = on_struts(seed, number)
    found = eigenstiffness(result)
    assert np.count_nonzero(found.values == 0) == 6 - number
    free = found.twists[found.values == 0].T
    assert np.abs(result.K @ free).max() <= 1e-7 * np.abs(result.K).max()


def test_a_singular_matrix_has_no_condition_number():
    result = rs.stiffness(rs.load("gough-stewart-a"))
    found = condition_number(result)
    assert found.two_norm is None
    assert found.frobenius is None
    assert found.isotropy == 0.0
    work = virtual_work(result)
    assert work.worst is None
    assert rs.Status.UNBALANCED in work.status
