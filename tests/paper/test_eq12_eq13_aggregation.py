"""Eq. (12) and (13): the sign, by displacing a point of a rigid body."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robostiff.elastostatics import aggregate_matrices
from robostiff.spatial import skew, twist_transport

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
