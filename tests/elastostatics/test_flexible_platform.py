"""Legs coupled by the compliance of a platform, as matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import (
    Status,
    Tolerance,
    WrenchBasis,
    aggregate,
    couple_legs,
    solve_chain,
)
from robostiff.errors import InputError

ONE = np.array(1.0)


def leg(rng: np.random.Generator, joints: int, batch: tuple[int, ...] = ()):
    root = rng.normal(size=(*batch, 6, 6))
    C, J_q = root @ np.swapaxes(root, -1, -2), rng.normal(size=(*batch, 6, joints))
    length = np.ones(batch)
    return C, solve_chain(C, J_q, WrenchBasis(), length, Tolerance())


def met(C: np.ndarray, solved) -> np.ndarray:
    return np.swapaxes(solved.held, -1, -2) @ C @ solved.held


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 5), min_size=1, max_size=4))
def test_condensation_of_the_platform_in_displacements(seed: int, joints: list[int]):
    """K_tt - K_tn (K_nn + diag K_i)^-1 K_nt, with the tool's own point for all nodes."""
    rng = np.random.default_rng(seed)
    legs = [leg(rng, count) for count in joints]
    n = 6 * len(legs)
    root = rng.normal(size=(n, n))
    C_platform = root @ root.T + 0.1 * np.eye(n)
    K_nn = np.linalg.inv(C_platform)
    D = np.tile(np.eye(6), (len(legs), 1))  # the nodes move with the tool
    K_nt, K_tt = -K_nn @ D, D.T @ K_nn @ D
    stiff = np.zeros((n, n))
    for i, (_, solved) in enumerate(legs):
        stiff[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = solved.K
    expected = K_tt - K_nt.T @ np.linalg.solve(K_nn + stiff, K_nt)
    W = np.zeros((n, sum(solved.held.shape[-1] for _, solved in legs)))
    column = 0
    for i, (_, solved) in enumerate(legs):
        stop = column + solved.held.shape[-1]
        W[6 * i : 6 * i + 6, column:stop] = solved.held
        column = stop
    coupled = couple_legs(
        [solved for _, solved in legs],
        [met(C, solved) for C, solved in legs],
        W.T @ C_platform @ W,
        np.zeros((column, 0)),
    )
    size = np.abs(K_tt).max() * np.linalg.cond(C_platform)
    assert np.allclose(coupled.whole.K, expected, rtol=0, atol=1e-12 * size)
    shares = np.sum([share.matrix for share in coupled.legs], axis=0)
    assert np.allclose(shares, coupled.whole.K, rtol=0, atol=1e-12 * size)


def test_nothing_that_bends_is_the_sum_of_the_legs():
    rng = np.random.default_rng(1)
    legs = [leg(rng, count, (4,)) for count in (3, 4, 5)]
    count = sum(solved.held.shape[-1] for _, solved in legs)
    solved = [own for _, own in legs]
    coupled = couple_legs(
        solved, [met(C, own) for C, own in legs], np.zeros((4, count, count)), np.zeros((count, 0))
    )
    expected = aggregate(solved)
    assert np.allclose(coupled.whole.K, expected.K, rtol=1e-10)
    assert np.array_equal(coupled.whole.rank, expected.rank)
    assert np.array_equal(coupled.whole.status_codes, expected.status_codes)


def test_a_rigid_leg_needs_a_platform_that_bends():
    held = solve_chain(np.zeros((6, 6)), np.eye(6)[:, 1:], WrenchBasis(), ONE, Tolerance())
    assert Status.RIGID_DIRECTION in held.status
    soft = couple_legs([held], [np.zeros((1, 1))], np.array([[0.5]]), np.zeros((1, 0)))
    assert soft.whole.K[0, 0] == pytest.approx(2.0)
    stiff = couple_legs([held], [np.zeros((1, 1))], np.array([[0.0]]), np.zeros((1, 0)))
    assert Status.RIGID_DIRECTION in stiff.whole.status
    assert np.allclose(np.abs(stiff.whole.rigid_directions), np.eye(6)[:1])


def test_motions_of_the_platform_take_wrenches_away():
    C, solved = leg(np.random.default_rng(2), 0)
    drive = np.eye(6)[:, [2]]
    free = couple_legs([solved], [met(C, solved)], np.zeros((6, 6)), solved.held.T @ drive)
    expected = solve_chain(C, drive, WrenchBasis(), ONE, Tolerance())
    assert int(free.whole.rank) == 5
    assert np.allclose(free.whole.K, expected.K, rtol=0, atol=1e-9 * np.abs(expected.K).max())
    twice = np.hstack([drive, drive])
    again = couple_legs([solved], [met(C, solved)], np.zeros((6, 6)), solved.held.T @ twice)
    assert again.whole.redundant.tolist() == [False, True]
    assert Status.REDUNDANT_JOINTS in again.whole.status
    assert np.allclose(again.whole.K, free.whole.K, rtol=0, atol=1e-9 * np.abs(expected.K).max())


@pytest.mark.parametrize("axes", [(0, 0, 1), (0, 1, 0), (1, 0, 0)])
def test_legs_that_pull_at_one_another_bend_the_platform(axes: tuple[int, ...]):
    """Their wrenches cancel at the tool, and still share the energy of the one that reaches it."""
    solved = [
        solve_chain(np.eye(6), np.delete(np.eye(6), axis, axis=1), WrenchBasis(), ONE, Tolerance())
        for axis in axes
    ]
    H = np.concatenate([own.held for own in solved], axis=-1)
    root = np.random.default_rng(4).normal(size=(3, 3))
    p, along_slide = root @ root.T, H[:1].T
    coupled = couple_legs(solved, [np.eye(1)] * 3, p, along_slide)
    # Least energy of x^T (p + 1) x with the slide free and the load along y: its own system.
    constraints = np.hstack([along_slide, H[1:2].T])
    inverse = np.linalg.inv(p + np.eye(3))
    compliance = np.linalg.inv(constraints.T @ inverse @ constraints)[1, 1]
    assert coupled.whole.K[1, 1] == pytest.approx(1.0 / compliance, rel=1e-12)


def test_shapes_must_fit():
    C, solved = leg(np.random.default_rng(3), 2)
    with pytest.raises(InputError, match="each of the 4 wrenches"):
        couple_legs([solved], [met(C, solved)], np.zeros((6, 6)), np.zeros((4, 0)))
