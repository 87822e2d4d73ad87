"""The default form against eq. (7) in 50 digits, redundant joints removed by exact rank."""

from dataclasses import replace

import numpy as np
import pytest

from robostiff.elastostatics import chain_stiffness
from tests.generators.chains import (
    FreeChain,
    Turning,
    random_beam,
    random_block,
    random_joint,
    random_single,
)
from tests.generators.exact import exact_stiffness, independent_columns
from tests.generators.metric import distance


def dyadic(rng: np.random.Generator, size: int = 3) -> np.ndarray:
    """Numbers k/8: sums and products of a few of them are exact in floating point."""
    return rng.integers(-8, 9, size) / 8.0


def exact_joint(rng: np.random.Generator) -> Turning:
    """A joint whose column of the Jacobian has no rounding at all; the axis is no unit vector."""
    axis = rng.choice([-2, -1, 1, 2], 3) * rng.integers(0, 2, 3) + np.eye(3)[rng.integers(3)]
    axis = axis if axis.any() else np.array([0, 0, 1])
    return Turning(None if rng.uniform() < 0.25 else 0.0, dyadic(rng), axis.astype(float))


def redundant_chain(seed: int) -> FreeChain:
    rng = np.random.default_rng(seed)
    springs = (random_beam(rng), random_block(rng))[: 1 + seed % 2]
    kind = seed % 3
    if kind == 0:  # two balls, and perhaps more
        points = dyadic(rng), dyadic(rng)
        joints = [Turning(0.0, point, axis) for point in points for axis in np.eye(3)]
    elif kind == 1:  # parallel axes
        axis = exact_joint(rng).axis
        joints = [Turning(0.0, dyadic(rng), axis) for _ in range(5)]
    else:
        joints = [exact_joint(rng) for _ in range(int(rng.integers(1, 8)))]
        joints.append(replace(joints[0], axis=-2 * joints[0].axis))
    return FreeChain(springs, tuple(joints), dyadic(rng))


def general_chain(seed: int) -> FreeChain:
    rng = np.random.default_rng(1000 + seed)
    springs = tuple(
        rng.choice(np.array([random_beam, random_block]))(rng)
        for _ in range(int(rng.integers(1, 4)))
    )
    joints = tuple(random_joint(rng) for _ in range(int(rng.integers(0, 6))))
    return FreeChain(springs, joints, rng.uniform(-1, 1, 3))


def few_springs_chain(seed: int) -> FreeChain:
    """Fewer than six springs, and so many turns that no direction is rigid."""
    rng = np.random.default_rng(2000 + seed)
    springs = int(rng.integers(1, 4))
    joints = tuple(replace(random_joint(rng), pitch=0.0) for _ in range(6 - springs))
    singles = tuple(random_single(rng) for _ in range(springs))
    return FreeChain(singles, joints, rng.uniform(-1, 1, 3))


@pytest.mark.parametrize("make", [general_chain, redundant_chain, few_springs_chain])
def test_agrees_to_1e_11(make):
    for seed in range(16):
        C, J_q = make(seed).matrices()
        K, rank = exact_stiffness(C, J_q)
        result = chain_stiffness(C, J_q)
        assert int(result.rank) == rank
        assert np.array_equal(np.flatnonzero(~result.redundant), independent_columns(J_q))
        if rank == 0:
            assert not result.K.any()
        else:
            assert distance(result.K, K) <= 1e-11


def test_exact_rank_tells_a_redundant_joint_from_a_nearly_redundant_one():
    column = np.array([1.0, 0, 0, 0, 0, 1.0])
    nearly = column + np.array([0, 2.0**-50, 0, 0, 0, 0])
    assert independent_columns(np.stack([column, 2 * column], axis=1)) == [0]
    assert independent_columns(np.stack([column, nearly], axis=1)) == [0, 1]


def _plain_inverse_is_right(seed: int) -> bool:
    C, J_q = redundant_chain(seed).matrices()
    q = J_q.shape[1]
    S = np.block([[C, J_q], [J_q.T, 1e-300 * np.eye(q)]])
    try:
        plain = np.linalg.inv(S)[:6, :6]
    except np.linalg.LinAlgError:
        return False
    K, _ = exact_stiffness(C, J_q)
    return distance(plain, K) <= 1e-11


def test_a_plain_inverse_would_be_caught():
    """Eq. (7) by a plain inverse is wrong with redundant joints, unless rounding is kind."""
    assert not all(_plain_inverse_is_right(seed) for seed in range(12))
