"""(7) to (15) of the paper: saddle point, block, recursion, frames, legs that share a platform."""

from itertools import permutations

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.analytic import canonical, rank_formula
from robostiff.elastostatics import aggregate_matrices, eliminate_block, saddle_point_matrix
from robostiff.spatial import block_rotation, rotate_stiffness, skew, twist_transport
from tests.cases.metric import distance
from tests.generators.chains import (
    FreeChain,
    random_beam,
    random_block,
    random_joint,
    random_rotation,
)
from tests.paper.exact_chain import block_form, eliminated, generic, symmetric, vanishes


def chain(seed: int, joints: int = 3) -> FreeChain:
    rng = np.random.default_rng(seed)
    return FreeChain(
        (random_beam(rng), random_block(rng)),
        tuple(random_joint(rng) for _ in range(joints)),
        rng.uniform(-1, 1, 3),
    )


@pytest.mark.parametrize("seed", range(6))
def test_solution_is_the_static_equilibrium(seed: int):
    """F and dq of (7) satisfy (6): springs carry J_theta^T F, joints carry nothing."""
    case = chain(seed)
    C, J_q = case.matrices()
    J_theta, K_theta = case.spring_columns(case.end)
    t = np.random.default_rng(seed).normal(size=6) * 1e-3
    solution = np.linalg.solve(saddle_point_matrix(C, J_q), np.concatenate([t, np.zeros(3)]))
    F, q = solution[:6], solution[6:]
    theta = np.linalg.solve(K_theta, J_theta.T @ F)
    assert np.abs(J_theta @ theta + J_q @ q - t).max() <= 1e-10 * np.abs(t).max()
    assert np.abs(J_q.T @ F).max() <= 1e-7 * np.abs(F).max()
    K = rs.chain_stiffness(C, J_q).K  # eq. (8)
    assert np.abs(K @ t - F).max() <= 1e-6 * np.abs(F).max()


@pytest.mark.parametrize("joints", [0, 1, 3, 5])
def test_upper_left_block(joints: int):
    C, J_q = chain(9, joints).matrices()
    size = np.trace(C)
    S = saddle_point_matrix(C / size, J_q)
    K = np.linalg.inv(S)[:6, :6] / size
    result = rs.chain_stiffness(C, J_q, form=rs.SaddlePoint())
    assert distance(K, result.K, sizes_of=np.linalg.inv(C)) <= 1e-9
    assert S.shape == (6 + joints, 6 + joints)
    assert np.array_equal(S, S.T)


def test_eq_7_does_not_need_six_springs():
    rng = np.random.default_rng(3)
    J_theta, J_q = rng.normal(size=(6, 2)), rng.normal(size=(6, 4))
    C = J_theta @ J_theta.T
    result = rs.chain_stiffness(C, J_q, form=rs.SaddlePoint())
    assert int(result.rank) == 2
    assert np.linalg.matrix_rank(result.K, tol=1e-9 * np.abs(result.K).max()) == 2


@pytest.mark.parametrize("joints", [1, 2, 4, 5])
def test_eq_9_is_eq_7(joints: int):
    C, J_q = chain(joints, joints).matrices()
    K0 = np.linalg.inv(C)
    printed = K0 - K0 @ J_q @ np.linalg.inv(J_q.T @ K0 @ J_q) @ J_q.T @ K0
    for K in (eliminate_block(K0, J_q), rs.chain_stiffness(C, J_q, form=rs.Block()).K):
        assert distance(K, printed, sizes_of=K0) <= 1e-9
    assert distance(printed, rs.chain_stiffness(C, J_q).K, sizes_of=K0) <= 1e-9


def test_frobenius_formula_with_symbols():
    """The upper-left block of the inverse in (7) is (9), entry by entry."""
    C = symmetric(3, "c")
    J = sp.Matrix(3, 1, sp.symbols("j1:4"))
    S = sp.Matrix(sp.BlockMatrix([[C, J], [J.T, sp.zeros(1)]]))
    K0 = C.inv()
    eq9 = K0 - K0 * J * (J.T * K0 * J).inv() * J.T * K0
    assert (S.inv()[:3, :3] - eq9).applyfunc(sp.cancel) == sp.zeros(3)


GROUPINGS = [
    ((0, 1, 2, 3),),
    ((3, 2), (1, 0)),
    ((1,), (0, 3, 2)),
    ((2, 0, 1), (3,)),
    ((3,), (2,), (1,), (0,)),
]


@pytest.mark.parametrize("groups", GROUPINGS)
def test_any_grouping(groups: tuple[tuple[int, ...], ...]):
    C, J_q = chain(1, 4).matrices()
    K0 = np.linalg.inv(C)
    all_at_once = eliminate_block(K0, J_q)
    K = K0
    for group in groups:
        J = J_q[:, list(group)]
        K = K - K @ J @ np.linalg.inv(J.T @ K @ J) @ J.T @ K
    assert distance(K, all_at_once, sizes_of=K0) <= 1e-9
    result = rs.chain_stiffness(C, J_q, form=rs.Recursive(groups=groups))
    assert distance(result.K, all_at_once, sizes_of=K0) <= 1e-9


# Three general joints: K0 = A^T A turns J_q into A J_q for K0 = I, a rotation of coordinates then
# clears three entries, and the length of a column does not matter.
a, b, c, d, e = sp.symbols("a:e")
UNIT, THREE = sp.eye(4), sp.Matrix([[1, a, b], [0, 1, c], [0, d, 1], [0, 0, e]])


def test_a_change_of_coordinates_changes_nothing_else():
    """Eq. (9) for A^T A and J is A^T (eq. (9) for I and A J) A."""
    A, J = generic(3, 3, "a"), generic(3, 2)
    assert vanishes(block_form(A.T * A, J) - A.T * block_form(sp.eye(3), A * J) * A)


def test_proposition_with_symbols():
    """Any grouping of three general joints, each group in any order, is (9) at once."""
    at_once = block_form(UNIT, THREE)
    for groups in (([0], [1, 2]), ([1, 2], [0]), ([2, 0], [1]), ([1], [0, 2])):
        K = UNIT
        for group in groups:
            K = canonical(block_form(K, THREE[:, group]))
        assert vanishes(K - at_once)


def test_corollary_with_symbols():
    """Single joints by (15), in all six orders, and the general K0 of a planar link."""
    at_once = block_form(UNIT, THREE)
    for order in permutations(range(3)):
        K = UNIT
        for i in order:
            K = canonical(eliminated(K, THREE[:, i]))
        assert vanishes(K - at_once)
    K0, J = symmetric(3), generic(3, 2)
    assert vanishes(block_form(block_form(K0, J[:, 1]), J[:, 0]) - block_form(K0, J))


def test_a_redundant_joint_has_no_mu_with_symbols():
    """The condition of the Proposition: J^T K J is zero for what earlier joints span."""
    K = canonical(block_form(symmetric(3), generic(3, 2)))
    again = generic(3, 2) * generic(2, 1, "c")
    assert vanishes(again.T * K * again)


def test_each_joint_takes_one_from_the_rank_with_symbols():
    """Eq. (16): the minors of size n - n_q remain, those that are one larger vanish."""
    K = UNIT
    for i in range(3):
        K = canonical(eliminated(K, THREE[:, i]))
        assert rank_formula(K).rank == 3 - i


@pytest.mark.parametrize("seed", range(5))
def test_energy_is_the_same_in_both_frames(seed: int):
    rng = np.random.default_rng(seed)
    R = random_rotation(rng)
    A = rng.normal(size=(6, 6))
    K_local, t_local = A @ A.T, rng.normal(size=6)
    t = np.concatenate([R @ t_local[:3], R @ t_local[3:]])
    F = np.concatenate([R @ (K_local @ t_local)[:3], R @ (K_local @ t_local)[3:]])
    K = rotate_stiffness(K_local, R)
    assert np.allclose(K @ t, F, rtol=0, atol=1e-12)
    assert np.isclose(t @ K @ t, t_local @ K_local @ t_local, rtol=1e-12)
    wrong = rotate_stiffness(K_local, R.T)
    assert not np.allclose(wrong @ t, F, rtol=0, atol=1e-3)


def test_batches_and_inverse():
    rng = np.random.default_rng(6)
    R = np.stack([random_rotation(rng) for _ in range(6)]).reshape(3, 1, 2, 3, 3)
    A = rng.normal(size=(6, 6))
    K = A + A.T
    turned = rotate_stiffness(K, R)
    assert turned.shape == (3, 1, 2, 6, 6)
    back = rotate_stiffness(turned, np.swapaxes(R, -1, -2))
    assert np.allclose(back, np.broadcast_to(K, back.shape), rtol=0, atol=1e-13)
    B = block_rotation(R)
    identity = np.broadcast_to(np.eye(6), B.shape)
    assert np.allclose(B @ np.swapaxes(B, -1, -2), identity, rtol=0, atol=1e-14)


SEEDS = range(5)


def printed(v: np.ndarray) -> np.ndarray:
    """J_v as printed in (13)."""
    J = np.eye(6)
    J[:3, 3:] = skew(v)
    return J


def displaced(v: np.ndarray, t_leg_end: np.ndarray) -> np.ndarray:
    """Twist of the reference point when the leg end has a small twist: a rigid body is moved."""
    h = 1e-5
    ends = []
    for sign in (1, -1):
        R = Rotation.from_rotvec(sign * h * t_leg_end[3:]).as_matrix()
        leg_end = sign * h * t_leg_end[:3]
        ends.append(leg_end + R @ v)  # v: from the leg end to the reference point
    return np.concatenate([(ends[0] - ends[1]) / (2 * h), t_leg_end[3:]])


@pytest.mark.parametrize("seed", SEEDS)
def test_corrected_sign(seed: int):
    rng = np.random.default_rng(seed)
    v, t = rng.normal(size=3), rng.normal(size=6)
    assert np.allclose(twist_transport(v) @ t, displaced(v, t), rtol=0, atol=1e-9)


def test_planar_transport_is_the_spatial_one():
    v = np.array([0.3, -0.2, 0.0])
    rows = np.ix_([0, 1, 5], [0, 1, 5])
    assert np.array_equal(twist_transport(v)[rows], twist_transport(v[:2]))


@pytest.mark.parametrize("seed", SEEDS)
def test_aggregated_force_is_the_sum_of_the_legs(seed: int):
    """Displace the platform, let every leg push at its own end, add forces and moments."""
    rng = np.random.default_rng(seed)
    t = rng.normal(size=6)
    legs, vectors, total = [], [], np.zeros(6)
    for _ in range(4):
        A, v = rng.normal(size=(6, 6)), rng.normal(size=3)
        K = A @ A.T
        at_end = np.concatenate([t[:3] + np.cross(t[3:], -v), t[3:]])
        F = K @ at_end
        total += np.concatenate([F[:3], F[3:] + np.cross(-v, F[:3])])
        legs.append(K)
        vectors.append(v)
    assert np.allclose(aggregate_matrices(legs, vectors) @ t, total, rtol=0, atol=1e-12 * 50)
    wrong = sum(
        np.linalg.inv(printed(v)).T @ K @ np.linalg.inv(printed(v))
        for K, v in zip(legs, vectors, strict=True)
    )
    assert np.abs(wrong @ t - total).max() > 0.1


def test_as_printed():
    x, y, z = 2.0, 3.0, 5.0
    printed = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    assert np.array_equal(skew(np.array([x, y, z])), printed)


def test_is_the_vector_product_and_skew():
    rng = np.random.default_rng(1)
    v, w = rng.normal(size=(2, 4, 2, 3))
    product = np.einsum("...ij,...j->...i", skew(v), w)
    assert np.allclose(product, np.cross(v, w), rtol=0, atol=1e-15)
    assert np.array_equal(skew(v), -np.swapaxes(skew(v), -1, -2))
