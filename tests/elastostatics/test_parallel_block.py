"""A parallel block in a chain: pinv(K) on range(K), freedoms null(K), shares of least energy."""

import numpy as np
import pytest

from robostiff.elastostatics import Tolerance, block_compliance
from tests.generators.chains import LENGTH

TOLERANCE = Tolerance()


def block_of(branches, length=LENGTH):
    return block_compliance(branches, np.array(length), TOLERANCE)


def freedoms(block) -> np.ndarray:
    return block.J_q[:, block.present]


def test_two_rigid_bars_side_by_side_are_a_rigid_parallelogram():
    """Bars along x at y = +-w/2, hinged about z at both ends: the far body moves along y alone."""
    length, w = 0.6, 0.1
    bars = []
    for y in (-w / 2, w / 2):
        # the twist of the point between the far hinges, eq. (17): e x (P - hinge)
        hinges = [np.array([y, -x, 0, 0, 0, 1.0]) for x in (-length, 0.0)]
        bars.append((np.zeros((6, 6)), np.stack(hinges, axis=-1)))
    block = block_of(bars)
    assert not np.any(block.C)
    (free,) = freedoms(block).T
    assert np.abs(free / free[1] - [0, 1, 0, 0, 0, 0]).max() < 1e-12
    assert not np.any(block.redundant)


def test_a_rigid_branch_takes_all_that_it_can():
    soft = (1e-6 * np.eye(6), np.zeros((6, 0)))
    rail = (np.zeros((6, 6)), np.eye(6)[:, [2]])  # rigid, but slides along z
    block = block_of([soft, rail])
    assert np.abs(block.C - np.diag([0, 0, 1e-6, 0, 0, 0])).max() < 1e-20
    assert freedoms(block).shape == (6, 0)
    assert np.abs(block.shares[1] - np.diag([1, 1, 0, 1, 1, 1])).max() < 1e-12


@pytest.mark.parametrize("soft", [1e4, 1e-3, 1e-9])
def test_a_soft_branch_leaves_the_shares_of_the_others_alone(soft):
    stiffnesses = (1e9, 4e9, soft)
    block = block_of([(np.eye(6) / k, np.zeros((6, 0))) for k in stiffnesses])
    whole = sum(stiffnesses)
    assert block.C[0, 0] == pytest.approx(1 / whole, rel=1e-9)
    for own, k in zip(block.shares[:, 0, 0], stiffnesses, strict=True):
        assert own == pytest.approx(k / whole, abs=1e-9)
