"""Springs: from matrices, in numbers and in symbols, and as objects."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.elasticity import (
    BeamSegment,
    beam_compliance,
    elasticity_from_compliance,
    elasticity_from_stiffness,
    moved,
    tapered_compliance,
)

seeds = st.integers(0, 2**32 - 1)
ranks = st.integers(0, 6)


def random_stiffness(rng, rank):
    """PSD of that rank, of the size of a machine: N/m, N, N m over arms of 0.1 m."""
    V = rng.normal(size=(6, rank)) * np.array([1, 1, 1, 0.1, 0.1, 0.1])[:, None]
    return V * 10 ** rng.uniform(5, 7, rank) @ V.T


def scaled(K, length=0.1):
    D = np.diag([1, 1, 1, 1 / length, 1 / length, 1 / length])
    return D @ K @ D


@given(seed=seeds)
def test_a_regular_stiffness_is_inverted(seed):
    K = random_stiffness(np.random.default_rng(seed), 6)
    spring = elasticity_from_stiffness(K)
    assert spring.freedoms.shape == (6, 0)
    residual = K @ spring.compliance - np.eye(6)
    condition = np.linalg.cond(scaled(K))
    np.testing.assert_allclose(residual, 0, atol=1e-14 * condition)
    assert (spring.compliance == spring.compliance.T).all()


@given(seed=seeds, rank=ranks)
def test_a_singular_stiffness_leaves_freedoms(seed, rank):
    K = random_stiffness(np.random.default_rng(seed), rank)
    spring = elasticity_from_stiffness(K)
    C, N = spring.compliance, spring.freedoms
    assert N.shape == (6, 6 - rank)
    assert np.linalg.matrix_rank(N) == 6 - rank
    size = np.abs(K).max() if rank else 1.0
    spectrum = np.linalg.eigvalsh(scaled(K))[6 - rank :]
    condition = spectrum[-1] / spectrum[0] if rank else 1.0
    np.testing.assert_allclose(K @ N, 0, atol=1e-12 * size * max(np.abs(N).max(initial=0), 1))
    np.testing.assert_allclose(K @ C @ K, K, atol=1e-12 * size * condition)
    assert (C == C.T).all()
    assert np.linalg.eigvalsh(C).min() >= -1e-12 * np.abs(C).max()


@given(seed=seeds, rank=ranks, unit=st.sampled_from([1e3, 1e-3, 1e6, 39.37]))
def test_metres_and_millimetres_decide_alike(seed, rank, unit):
    # Lengths in another unit, forces kept: twists (u m, rad), wrenches (N, u N m).
    K = random_stiffness(np.random.default_rng(seed), rank)
    twist = np.diag([unit, unit, unit, 1, 1, 1])
    wrench = np.diag([1, 1, 1, unit, unit, unit])
    ours = elasticity_from_stiffness(K)
    theirs = elasticity_from_stiffness(wrench @ K @ np.linalg.inv(twist))
    assert theirs.freedoms.shape == ours.freedoms.shape
    back = np.linalg.inv(twist) @ theirs.compliance @ wrench
    spectrum = np.linalg.eigvalsh(scaled(K))[6 - rank :]
    condition = spectrum[-1] / spectrum[0] if rank else 1.0
    expected = scaled(ours.compliance, length=10)
    difference = scaled(back, length=10) - expected
    np.testing.assert_allclose(difference, 0, atol=1e-12 * condition * np.abs(expected).max())


@pytest.mark.parametrize("free", [[5], [3, 4], [0, 5], [0, 1, 2], [3, 4, 5], range(6), []])
def test_axis_aligned_freedoms_are_unit_twists(free):
    diagonal = np.array([1e6, 2e6, 3e6, 100.0, 200.0, 300.0])
    diagonal[list(free)] = 0
    spring = elasticity_from_stiffness(np.diag(diagonal))
    np.testing.assert_allclose(spring.freedoms, np.eye(6)[:, list(free)], atol=1e-15)
    expected = np.divide(1, diagonal, out=np.zeros(6), where=diagonal > 0)
    np.testing.assert_allclose(spring.compliance, np.diag(expected), rtol=1e-14, atol=1e-30)


def test_soft_is_not_free():
    K = np.diag([1e9, 1e9, 1e-1, 1e3, 1e3, 1e3])
    spring = elasticity_from_stiffness(K)
    assert spring.freedoms.shape == (6, 0)
    assert spring.compliance[2, 2] == pytest.approx(10.0, rel=1e-14)


def test_small_asymmetry_is_averaged():
    K = np.diag([1e6, 2e6, 3e6, 100.0, 200.0, 300.0])
    K[0, 1] = 2e-4
    C = elasticity_from_stiffness(K).compliance
    assert (C == C.T).all()
    assert C[0, 1] == pytest.approx(-1e-4 / (1e6 * 2e6), rel=1e-9)
    C = elasticity_from_compliance(K).compliance
    assert C[0, 1] == C[1, 0] == 1e-4


def test_asymmetry_is_measured_against_its_own_block():
    """1e-3 N m/rad in the rotations of this matrix is refused, see tests/laws/misuse.txt."""
    K = np.diag([1e9, 1e9, 1e9, 100.0, 100.0, 100.0])
    K[0, 4] = 1e-4  # against sqrt(1e9 * 100) = 3e5
    elasticity_from_stiffness(K)


def test_rigid_directions_of_a_compliance_are_allowed():
    C = np.zeros((6, 6))
    C[2, 2] = 1e-8
    spring = elasticity_from_compliance(C)
    np.testing.assert_array_equal(spring.compliance, C)
    assert spring.freedoms.shape == (6, 0)
    assert (elasticity_from_compliance(np.zeros((6, 6))).compliance == 0).all()


def displaced(twist, R, v):
    """Twist of the element point by rigid body kinematics, written out without matrices."""
    translation, turn = R @ twist[:3], R @ twist[3:]
    return np.concatenate([translation + np.cross(turn, v), turn])


@given(seed=seeds, rank=ranks)
def test_moved_by_rigid_body_kinematics(seed, rank):
    rng = np.random.default_rng(seed)
    spring = elasticity_from_stiffness(random_stiffness(rng, rank))
    R, v = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    new = moved(spring, R, v)
    for old, there in zip(spring.freedoms.T, new.freedoms.T, strict=True):
        np.testing.assert_allclose(there, displaced(old, R, v), atol=1e-13)
    # A wrench at P, in the axes of the element, and the same at E in the axes of the spring.
    F = rng.normal(size=6)
    at_E = np.concatenate([R.T @ F[:3], R.T @ (F[3:] + np.cross(v, F[:3]))])
    expected = displaced(spring.compliance @ at_E, R, v)
    size = np.abs(expected).max() if rank else 1.0
    np.testing.assert_allclose(new.compliance @ F, expected, atol=1e-10 * size)


def test_moved_batches():
    C = beam_compliance(np.array([0.5, 0.7]), rs.material("steel"), rs.rectangle(0.02, 0.05))
    far = moved(rs.Elasticity(C), np.eye(3), [0, 0, 1]).compliance
    single = moved(rs.Elasticity(C[1]), np.eye(3), [0, 0, 1]).compliance
    np.testing.assert_allclose(far[1], single, rtol=1e-14, atol=0)


def test_arrays_are_copied_and_read_only():
    C, N = np.eye(6), np.eye(6)[:, :2]
    spring = rs.Elasticity(C, N)
    C[0, 0] = N[0, 0] = 7
    assert spring.compliance[0, 0] == spring.freedoms[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        spring.compliance[0, 0] = 2
    with pytest.raises(ValueError, match="read-only"):
        spring.freedoms[0, 0] = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        spring.compliance = C  # type: ignore[misc]


def test_no_freedoms_unless_given():
    a, b = rs.Elasticity(np.eye(6)), rs.Elasticity(np.eye(6))
    assert a.freedoms.shape == (6, 0)
    assert a.freedoms is not b.freedoms


def test_batches_and_integers():
    spring = rs.Elasticity(np.zeros((4, 2, 6, 6), dtype=int))
    assert spring.compliance.shape == (4, 2, 6, 6)
    assert spring.compliance.dtype == np.float64


def test_symbolic_entries_stay():
    k = sp.Symbol("k")
    compliance = np.full((6, 6), 0, dtype=object)
    compliance[0, 0] = 1 / k
    assert rs.Elasticity(compliance).compliance[0, 0] == 1 / k


@pytest.mark.parametrize(
    ("make", "block"), [(rs.translational_spring, slice(0, 3)), (rs.rotational_spring, slice(3, 6))]
)
def test_springs_along_one_axis(make, block):
    axis = np.array([1.0, -2.0, 2.0])
    spring = make(4e3, axis)
    assert spring.freedoms.shape == (6, 0)
    compliance = spring.compliance[block, block]
    np.testing.assert_allclose(compliance @ axis, axis / 4e3, rtol=1e-14)
    np.testing.assert_allclose(compliance @ [0, 1, 1], 0, atol=1e-19)
    rest = spring.compliance.copy()
    rest[block, block] = 0
    assert (rest == 0).all()
    np.testing.assert_allclose(make(4e3, -3 * axis).compliance, spring.compliance, rtol=1e-14)


k, c, L, d = sp.symbols("k c L d", positive=True)
VALUES = {k: 3e6, c: 2e3, L: 0.4, d: 0.02}


def at_values(formulas):
    return np.array(sp.Matrix(np.atleast_2d(formulas)).subs(VALUES).tolist(), dtype=float)


def test_coupled_stiffness_is_inverted():
    K = sp.diag(k, k, 2 * k, c, c, c)
    K[1, 5] = K[5, 1] = -k * L / 100
    found = elasticity_from_stiffness(K)
    wanted = elasticity_from_stiffness(at_values(K))
    assert found.freedoms.shape == (6, 0)
    np.testing.assert_allclose(at_values(found.compliance), wanted.compliance, rtol=1e-12)


def test_zero_stiffness_is_a_freedom():
    found = elasticity_from_stiffness(sp.diag(k, k, k, c, 0, c))
    assert found.freedoms.T.tolist() == [[0, 0, 0, 0, 1, 0]]
    assert found.compliance[3, 3] == 1 / c
    assert found.compliance[4, 4] == 0


def test_numbers_that_leave_a_coupled_direction_free_are_computed_as_numbers():
    K = np.diag([2, 2, 2, 1, 1, 1]).astype(object)
    K[0, 1] = K[1, 0] = 2
    exact = np.vectorize(sp.Integer, otypes=[object])(K)
    found, wanted = elasticity_from_stiffness(exact), elasticity_from_stiffness(K.astype(float))
    np.testing.assert_array_equal(found.compliance, wanted.compliance)
    assert found.freedoms.shape == (6, 1)


def test_spring_is_moved_exactly():
    a = sp.Symbol("a", real=True)
    turn = [[sp.cos(a), -sp.sin(a), 0], [sp.sin(a), sp.cos(a), 0], [0, 0, 1]]
    hinge = elasticity_from_compliance(sp.diag(0, 0, 0, 0, 0, 1 / c))
    found = moved(hinge, turn, [L, 0, 0])
    assert found.compliance[1, 1] == L**2 / c
    assert found.compliance[1, 5] == L / c


def test_two_halves_make_the_whole():
    soft = rs.Material("soft", E=2e11, G=8e10)
    half = BeamSegment(L / 2, soft, rs.circle(d))
    halves = sp.Matrix(tapered_compliance([half, half]))
    whole = sp.Matrix(tapered_compliance([BeamSegment(L, soft, rs.circle(d))]))
    assert sp.simplify(halves - whole) == sp.zeros(6, 6)


def test_length_of_numbers_beside_a_symbolic_section_stays_exact():
    segment = BeamSegment(0.25, rs.Material("soft", E=2e11, G=8e10), rs.circle(d))
    found = tapered_compliance([segment, segment])
    assert not any(sp.sympify(entry).has(sp.Float) for entry in found.flat)
    assert found[0, 0] == sp.Rational(1, 10**11) / (sp.pi * d**2)


def test_entries_beside_the_diagonal_are_bounded():
    """Only the diagonal was: a matrix with a negative eigenvalue became a spring."""
    e = sp.Symbol("e", real=True)
    M = sp.diag(k, k, k, c, c, c)
    M[1, 5] = M[5, 1] = e
    for make in (elasticity_from_stiffness, elasticity_from_compliance):
        (bound,) = make(M).bounds
        assert sp.expand(bound.value - (k * c - e**2)) == 0
        with pytest.raises(rs.InputError, match="no negative eigenvalue"):
            make(M.subs(e, 2 * sp.sqrt(k * c)))


def test_a_compliance_that_vanishes_identically_is_no_bound():
    """Of a lever, whose two rows are one."""
    e = sp.Symbol("e", real=True)
    M = sp.zeros(6)
    M[:2, :2] = sp.Matrix([1, e]) * sp.Matrix([[1, e]]) / k
    assert not elasticity_from_compliance(M).bounds
