"""K_C is symmetric and semidefinite, is zero along its joints, and they never stiffen it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import chain_stiffness
from tests.generators.chains import LENGTH, FreeChain, chains, joint_rank, planar_chains
from tests.generators.metric import rounding

ANY_CHAIN = st.one_of(chains(), planar_chains())


def in_lengths(K: np.ndarray) -> np.ndarray:
    """A stiffness matrix with turns multiplied by a length, N/m throughout."""
    t = 3 if K.shape[-1] == 6 else 2
    s = np.array([1.0] * t + [1 / LENGTH] * (K.shape[-1] - t))
    return K * np.outer(s, s)


def unit_columns(J_q: np.ndarray) -> np.ndarray:
    """Joint twists in lengths, of unit size."""
    t = 3 if J_q.shape[0] == 6 else 2
    scaled = np.concatenate([J_q[:t], LENGTH * J_q[t:]])
    return scaled / np.linalg.norm(scaled, axis=0)


@given(ANY_CHAIN)
def test_symmetric_and_positive_semidefinite(chain: FreeChain):
    C, J_q = chain.matrices()
    K = chain_stiffness(C, J_q).K
    assert np.array_equal(K, K.T)
    values = np.linalg.eigvalsh(in_lengths(K))
    largest = np.abs(np.linalg.eigvalsh(in_lengths(np.linalg.inv(C)))).max()
    assert values[0] >= -max(rounding(C), 1e-12) * largest


@given(ANY_CHAIN)
def test_passive_joints_meet_no_stiffness(chain: FreeChain):
    C, J_q = chain.matrices()
    K = in_lengths(chain_stiffness(C, J_q).K)
    K0 = in_lengths(np.linalg.inv(C))
    left = np.abs(K @ unit_columns(J_q)).max(initial=0.0)
    assert left <= max(rounding(C), 1e-12) * np.abs(K0).max()


@given(ANY_CHAIN)
def test_rank_is_what_the_joints_leave(chain: FreeChain):
    C, J_q = chain.matrices()
    result = chain_stiffness(C, J_q)
    n, rank = len(C), joint_rank(J_q)
    assert int(result.rank) == n - rank
    assert np.count_nonzero(result.redundant) == J_q.shape[1] - rank
    assert len(result.free_motions) == rank
    # the matrix itself has that rank: its eigenvalues fall off a cliff
    values = np.sort(np.abs(np.linalg.eigvalsh(in_lengths(result.K))))[::-1]
    cliff = 1e-11 * np.abs(in_lengths(np.linalg.inv(C))).max()
    assert np.count_nonzero(values > cliff) == n - rank


@given(ANY_CHAIN)
def test_passive_joints_never_stiffen(chain: FreeChain):
    C, J_q = chain.matrices()
    K0 = in_lengths(np.linalg.inv(C))
    fewer = in_lengths(chain_stiffness(C, J_q[:, : J_q.shape[1] // 2]).K)
    all_joints = in_lengths(chain_stiffness(C, J_q).K)
    for less in (K0 - fewer, fewer - all_joints):
        assert np.linalg.eigvalsh(less)[0] >= -max(rounding(C), 1e-12) * np.abs(K0).max()


@given(st.one_of(chains(regular=False), chains()))
def test_springs_in_any_number(chain: FreeChain):
    """Where rank(J_theta) < 6, K is there unless a transmitted wrench meets no compliance."""
    C, J_q = chain.matrices()
    result = chain_stiffness(C, J_q)
    J_theta, _ = chain.spring_columns(chain.end)
    together = np.hstack([unit_columns(J_theta), unit_columns(J_q)])
    held_everywhere = np.linalg.matrix_rank(together, tol=1e-8) == 6
    assert bool(result.answered) == held_everywhere
    assert int(result.rank) == 6 - joint_rank(J_q)
    if held_everywhere:
        K = in_lengths(result.K)
        assert np.isfinite(K).all()
        assert np.linalg.eigvalsh(K)[0] >= -1e-11 * np.abs(K).max(initial=1.0)
    else:
        assert np.isfinite(result.matrix).all()
