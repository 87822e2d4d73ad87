"""Half of t^T K t is the least energy over all internal coordinates that reach t, eq. (1)-(3)."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robostiff.elastostatics import chain_stiffness
from tests.generators.chains import FreeChain, chains, planar_chains


def least_energy(J_theta: np.ndarray, K_theta: np.ndarray, J_q: np.ndarray, t: np.ndarray) -> float:
    """Least energy with J_theta theta + J_q q = t, by its Lagrange conditions."""
    m, q, n = J_theta.shape[1], J_q.shape[1], len(t)
    unit = np.trace(K_theta) / m
    root = np.linalg.cholesky(K_theta / unit)
    A = np.linalg.solve(root, J_theta.T).T  # springs of unit stiffness
    S = np.zeros((m + q + n, m + q + n))
    S[:m, :m] = np.eye(m)
    S[:m, m + q :], S[m + q :, :m] = A.T, A
    S[m : m + q, m + q :], S[m + q :, m : m + q] = J_q.T, J_q
    wanted = np.concatenate([np.zeros(m + q), t])
    x, *_ = np.linalg.lstsq(S, wanted, rcond=1e-13)
    assert np.abs(A @ x[:m] + J_q @ x[m : m + q] - t).max() < 1e-9 * np.abs(t).max()
    return 0.5 * unit * float(x[:m] @ x[:m])


@given(st.one_of(chains(), planar_chains(), chains(regular=False)), st.integers(0, 2**32 - 1))
def test_energy_is_the_minimum_over_internal_coordinates(chain: FreeChain, seed: int):
    C, J_q = chain.matrices()
    result = chain_stiffness(C, J_q)
    if not result.answered:
        return  # a rigid direction: some t are out of reach
    J_theta, K_theta = chain.spring_columns(chain.end)
    t = np.random.default_rng(seed).normal(size=len(C))
    energy = 0.5 * float(t @ result.K @ t)
    least = least_energy(J_theta, K_theta, J_q, t)
    # measured by the energy with the joints held, where there is one
    whole = 0.5 * float(t @ np.linalg.pinv(C) @ t) if chain.springs[0].stiffness.size > 1 else least
    assert abs(energy - least) <= 1e-8 * least + 1e-11 * abs(whole)
