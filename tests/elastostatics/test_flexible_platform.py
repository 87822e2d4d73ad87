"""Branches between bodies, against the condensation of all bodies in displacements."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import Status, Tolerance, aggregate, leg_wrenches, solved_leg
from robostiff.elastostatics.leg import loads_of_compliance, transmitted
from robostiff.elastostatics.parallel_block import BlockCompliance, block_of

ONE, TOLERANCE = np.array(1.0), Tolerance()
TRIANGLE = [(0, 2), (0, 3), (2, 1), (3, 1), (2, 3)]  # two legs on a frame of three members


def solved(C: np.ndarray, J_q: np.ndarray):
    wrenches = leg_wrenches(J_q, loads_of_compliance(C, ONE), ONE, TOLERANCE)
    return solved_leg(wrenches, ONE, TOLERANCE)


def branch(rng: np.random.Generator, joints: int):
    root = rng.normal(size=(6, 6))
    return solved(root @ root.T, rng.normal(size=(6, joints)))


def joined(branches, ends) -> BlockCompliance:
    return block_of([transmitted(own) for own in branches], ONE, TOLERANCE, ends)


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 2), min_size=5, max_size=5))
def test_condensation_in_displacements(seed: int, joints: list[int]):
    """K_tt - K_tn K_nn^-1 K_nt of the stiffnesses of all branches on the bodies between them."""
    rng = np.random.default_rng(seed)
    branches = [branch(rng, count) for count in joints]
    K = np.zeros((4, 6, 4, 6))
    for own, (a, b) in zip(branches, TRIANGLE, strict=True):
        for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            K[i, :, j] += sign * own.K
    K = K[1:, :, 1:].reshape(18, 18)
    between = np.linalg.cond(K[6:, 6:])
    if between > 1e6:
        return
    expected = K[:6, :6] - K[:6, 6:] @ np.linalg.solve(K[6:, 6:], K[6:, :6])
    found = joined(branches, TRIANGLE)
    if found.J_q.shape[-1] or np.linalg.cond(expected) > 1e6:
        return
    assert np.allclose(found.C @ expected, np.eye(6), rtol=0, atol=1e-13 * between * 1e6)
    carried = found.shares
    assert np.allclose(carried[0] + carried[1], np.eye(6), rtol=0, atol=1e-9)
    assert np.allclose(carried[2] + carried[3], np.eye(6), rtol=0, atol=1e-9)
    assert np.allclose(carried[0], carried[2] + carried[4], rtol=0, atol=1e-9)


def test_members_that_do_not_bend_leave_the_sum_of_the_legs():
    rng = np.random.default_rng(1)
    legs = [branch(rng, count) for count in (3, 4, 5)]
    rigid = solved(np.zeros((6, 6)), np.zeros((6, 0)))
    ends = [(0, 2), (0, 3), (0, 1), (2, 1), (3, 1), (2, 3)]
    found = joined([*legs, rigid, rigid, rigid], ends)
    assert np.allclose(found.C @ aggregate(legs).K, np.eye(6), rtol=0, atol=1e-9)


def test_a_rigid_leg_needs_a_platform_that_bends():
    held = solved(np.zeros((6, 6)), np.eye(6)[:, 1:])
    assert Status.RIGID_DIRECTION in held.status
    for softness in (0.5, 0.0):
        member = solved(softness * np.eye(6), np.zeros((6, 0)))
        found = joined([held, member], [(0, 2), (2, 1)])
        assert np.allclose(found.C, np.diag([softness, 0, 0, 0, 0, 0]))
        assert found.W.shape[-1] == 1


def test_motions_of_the_platform_take_wrenches_away():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(6, 6))
    C, drive = root @ root.T, np.eye(6)[:, [2]]
    rigid = solved(np.zeros((6, 6)), drive)
    expected = solved(C, drive)
    for hinges in (1, 2):  # the body between two of them moves with the tool at rest
        bodies = [0, *range(2, 2 + hinges), 1]
        ends = list(pairwise(bodies))
        found = joined([solved(C, np.zeros((6, 0))), *[rigid] * hinges], ends)
        assert found.W.shape[-1] == 5
        K = expected.K
        assert np.allclose(K @ found.C @ K, K, rtol=0, atol=1e-9 * np.abs(K).max())
        moving = np.count_nonzero(np.any(found.mechanisms != 0, axis=0))
        assert moving == hinges
