"""Eq. (11): from local to global axes."""

import numpy as np
import pytest

from robostiff.spatial import block_rotation, rotate_stiffness
from tests.generators.chains import random_rotation


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
