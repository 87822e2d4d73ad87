"""Remarks 1 to 4: when the terms of (9) exist, and what their difference is."""

import numpy as np
import pytest

from robostiff import NoAnswerError
from robostiff.elastostatics import Block, chain_stiffness
from tests.paper.test_eq07_saddle_point import chain


@pytest.mark.parametrize("springs", range(1, 9))
def test_remark_1_first_term_needs_six_independent_springs(springs: int):
    J_theta = np.random.default_rng(springs).normal(size=(6, springs))
    C = 1e-6 * J_theta @ J_theta.T
    result = chain_stiffness(C, np.eye(6)[:, :1], form=Block())
    regular = np.linalg.matrix_rank(J_theta) == 6
    assert bool(result.answered) == regular
    if not regular:
        with pytest.raises(NoAnswerError, match=r"rank\(J_theta\) < n"):
            _ = result.K


def test_remark_2_second_term_needs_independent_joints():
    C, J_q = chain(1, 3).matrices()
    assert chain_stiffness(C, J_q, form=Block()).answered
    dependent = np.hstack([J_q, J_q @ np.ones((3, 1))])
    refused = chain_stiffness(C, dependent, form=Block())
    assert not refused.answered
    M = dependent.T @ np.linalg.inv(C) @ dependent
    assert np.linalg.matrix_rank(M, tol=1e-9 * np.abs(M).max()) == 3


@pytest.mark.parametrize("joints", range(6))
def test_remark_3_rank(joints: int):
    """6 - n_q for independent joints; 6 - rank(J_q) whatever they are."""
    C, J_q = chain(2, joints).matrices()
    assert int(chain_stiffness(C, J_q).rank) == 6 - joints
    doubled = np.hstack([J_q, J_q])
    assert int(chain_stiffness(C, doubled).rank) == 6 - joints


@pytest.mark.parametrize("seed", range(5))
def test_remark_4_symmetric_and_semidefinite(seed: int):
    C, J_q = chain(seed, 2).matrices()
    K = chain_stiffness(C, J_q, form=Block()).K
    assert np.array_equal(K, K.T)
    values = np.linalg.eigvalsh(K)
    assert values[0] >= -1e-12 * np.abs(np.linalg.inv(C)).max()
    assert values[-1] > 0
