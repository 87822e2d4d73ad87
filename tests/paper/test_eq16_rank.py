"""Eq. (16): every independent joint takes one from the rank, a redundant one nothing."""

import numpy as np

from robostiff.elastostatics import chain_stiffness
from tests.paper.test_eq07_saddle_point import chain


def test_one_joint_after_the_other():
    C, J_q = chain(5, 5).matrices()
    for joints in range(6):
        result = chain_stiffness(C, J_q[:, :joints])
        assert int(result.rank) == 6 - joints
        values = np.linalg.eigvalsh(result.K / np.abs(np.linalg.inv(C)).max())
        assert np.count_nonzero(np.abs(values) > 1e-12) == 6 - joints


def test_a_redundant_joint_takes_nothing():
    C, J_q = chain(5, 3).matrices()
    again = np.hstack([J_q, J_q[:, :1] - 2 * J_q[:, 1:2]])
    result = chain_stiffness(C, again)
    assert int(result.rank) == 3
    assert result.redundant.tolist() == [False, False, False, True]
