"""Eq. (5)-(8): the saddle-point system and its solution."""

import numpy as np
import pytest

from robostiff.elastostatics import SaddlePoint, chain_stiffness, saddle_point_matrix
from tests.cases.metric import distance
from tests.generators.chains import FreeChain, random_beam, random_block, random_joint


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
    K = chain_stiffness(C, J_q).K  # eq. (8)
    assert np.abs(K @ t - F).max() <= 1e-6 * np.abs(F).max()


@pytest.mark.parametrize("joints", [0, 1, 3, 5])
def test_upper_left_block(joints: int):
    C, J_q = chain(9, joints).matrices()
    size = np.trace(C)
    S = saddle_point_matrix(C / size, J_q)
    K = np.linalg.inv(S)[:6, :6] / size
    result = chain_stiffness(C, J_q, form=SaddlePoint())
    assert distance(K, result.K, sizes_of=np.linalg.inv(C)) <= 1e-9
    assert S.shape == (6 + joints, 6 + joints)
    assert np.array_equal(S, S.T)


def test_eq_7_does_not_need_six_springs():
    rng = np.random.default_rng(3)
    J_theta, J_q = rng.normal(size=(6, 2)), rng.normal(size=(6, 4))
    C = J_theta @ J_theta.T
    result = chain_stiffness(C, J_q, form=SaddlePoint())
    assert int(result.rank) == 2
    assert np.linalg.matrix_rank(result.K, tol=1e-9 * np.abs(result.K).max()) == 2
