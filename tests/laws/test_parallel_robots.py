"""Laws of legs in parallel: sums, ranks by geometry, and the whole system solved at once."""

from collections.abc import Sequence
from dataclasses import replace
from random import Random

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import robostiff as rs
from robostiff import deflection, stiffness
from robostiff.elastostatics import aggregate_matrices
from tests.generators.chains import FreeChain
from tests.generators.metric import distance
from tests.generators.robots import FreeRobot, robots

SEEDS = st.integers(0, 2**32 - 1)


@given(robots(), st.randoms(use_true_random=False), SEEDS, st.sampled_from([1e-6, 1e6]))
def test_legs_add_up_in_any_order_about_any_point_in_any_unit(
    robot: FreeRobot, random: Random, seed: int, factor: float
):
    result = stiffness(robot.snapshot)
    K = sum(rs.chain_stiffness(*leg.matrices(robot.reference)).K for leg in robot.legs)
    assert distance(result.K, np.asarray(K)) <= robot.rounding()
    # and legs given about their own ends, brought together by eq. (12)
    legs = [rs.chain_stiffness(*leg.matrices()).K for leg in robot.legs]
    moved = aggregate_matrices(legs, [robot.reference - leg.end for leg in robot.legs])
    assert distance(moved, result.K) <= 100 * robot.rounding()  # lever arms cost digits

    mixed = list(robot.legs)
    random.shuffle(mixed)
    shuffled = stiffness(FreeRobot(tuple(mixed), robot.reference).snapshot)
    assert distance(shuffled.K, result.K) <= robot.rounding()
    assert _decided(shuffled) == _decided(result)

    point = np.random.default_rng(seed).uniform(-1, 1, 3)
    there = stiffness(robot.snapshot, at=point)
    direct = stiffness(FreeRobot(robot.legs, point).snapshot)
    assert distance(there.K, direct.K) <= 1e-8
    assert _decided(there) == _decided(direct)

    harder = stiffness(FreeRobot(_harder(robot.legs, factor), robot.reference).snapshot)
    assert _decided(harder) == _decided(result)
    assert distance(harder.K, factor * result.K) <= 1e-9


def _decided(found: rs.Stiffness) -> tuple[int, rs.Status]:
    return int(found.rank), found.status


def _harder(legs: Sequence[FreeChain], factor: float) -> tuple[FreeChain, ...]:
    """Legs with springs of so many times the stiffness."""
    return tuple(
        replace(leg, springs=tuple(replace(s, stiffness=factor * s.stiffness) for s in leg.springs))
        for leg in legs
    )


@given(robots())
def test_geometry_decides_the_rank(robot: FreeRobot):
    """That of the wrenches that hold the platform, also with a leg 1e-9 times softer."""
    result, rank = stiffness(robot.snapshot), robot.rank()
    assert int(result.rank) == rank
    free = result.details().free_motions
    assert len(free) == 6 - rank
    assert (rs.Status.FREE_MOTIONS in result.status) == (rank < 6)
    K = result.K
    assert np.array_equal(K, K.T)
    assert np.abs(K @ free.T).max(initial=0.0) <= 1e-10 * np.abs(K).max()
    first, *others = robot.legs
    soft = FreeRobot((*_harder([first], 1e-9), *others), robot.reference)
    assert int(stiffness(soft.snapshot).rank) == rank

    full = all(np.linalg.matrix_rank(leg.spring_columns(leg.end)[0]) == 6 for leg in robot.legs)
    recursive = stiffness(robot.snapshot, method=rs.Recursive())
    assert bool(recursive.answered) == full
    if full:
        K0 = sum(np.linalg.inv(leg.compliance(robot.reference)) for leg in robot.legs)
        assert distance(recursive.K, K, sizes_of=np.asarray(K0)) <= 1e-9
        assert np.array_equal(recursive.details().redundant, result.details().redundant)


@given(robots(), SEEDS)
def test_deflection_is_that_of_the_whole_system_at_once(robot: FreeRobot, seed: int):
    F = np.random.default_rng(seed).normal(size=6) * [100, 100, 100, 30, 30, 30]
    bent = deflection(robot.snapshot, wrench=F)
    if robot.rank() < 6:
        assert bent.status & rs.Status.UNBALANCED
        # a load that the legs can carry has an answer all the same
        K = bent.stiffness.K
        F = K @ np.random.default_rng(seed).normal(size=6) * 1e-6
        bent = deflection(robot.snapshot, wrench=F)
    t, energy = robot.whole_system(F)
    assert abs(bent.energy - energy) <= 1e-6 * energy
    work = np.abs(bent.stiffness.K @ (t - bent.twist)).max()
    assert work <= 1e-6 * np.abs(F).max()
