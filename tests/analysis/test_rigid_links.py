"""The textbook K = J^-T k J^-1: rigid links, elastic drives; and blocks with rigid branches."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.elastostatics import Status
from robostiff.model import Actuated, PlacedFreedom, PlacedLeg, PlacedSpring, Snapshot

HERE = Path(__file__).parent


def test_a_beam_beside_a_rigid_branch_is_rigid():
    """The same physics, with a beam that carries nothing and without; alone and in a batch."""
    clamp, plain = (rs.load(HERE / f"{name}.yaml") for name in ("clamp", "noclamp"))
    expected = rs.stiffness(plain)
    assert expected.K[0, 0] == pytest.approx(4756287, rel=1e-6)
    alone = rs.stiffness(clamp)
    assert np.abs(alone.K - expected.K).max() < 1e-11 * np.abs(expected.K).max()
    assert alone.status == expected.status
    poses = np.array([[0.3], [0.31], [0.25]])
    together, one_by_one = rs.stiffness(clamp, poses), [rs.stiffness(plain, p) for p in poses]
    for K, other in zip(together.K, one_by_one, strict=True):
        assert np.abs(K - other.K).max() < 1e-11 * np.abs(other.K).max()


@pytest.mark.parametrize("reference", [(0, 0, 0), (0.4, 0.1, 0.2), (1e-3, 0, 0), (50, 20, -3)])
def test_a_robot_in_one_point_is_the_same_about_every_point(reference):
    """Three springs through one point, and a joint there: status and rank belong to the robot."""
    from robostiff.elasticity import Elasticity
    from robostiff.model import Passive

    at = np.array([0.2, -0.1, 0.3])
    C = np.diag([1e-7, 2e-7, 3e-7, 1e-2, 2e-2, 5e-2])
    spring = PlacedSpring("spring", at, np.eye(3), Elasticity(C))
    joint = PlacedFreedom(np.array([0.0, 0.0, 1.0]), at, 0.0, "joint", Passive())
    snapshot = Snapshot("point", (PlacedLeg("leg", (spring, joint), at),), np.array(reference))
    result = rs.stiffness(snapshot)
    there = rs.stiffness(replace(snapshot, reference_point=at))
    assert result.status == there.status == Status.FREE_MOTIONS
    assert int(result.rank) == 5
    moved = there.about(np.array(reference, dtype=float))
    assert np.abs(result.K - moved.K).max() <= 1e-9 * np.abs(moved.K).max()


def test_axes_that_meet_in_the_origin_but_for_rounding_turn_about_it():
    """A spherical five-bar, one drive held rigidly: one turn is left, wherever its point is."""
    from robostiff.model import Passive

    for seed in range(20):
        rng = np.random.default_rng(seed)

        def leg(name: str, count: int, rng: np.random.Generator = rng) -> PlacedLeg:
            axes = rng.normal(size=(count, 3))
            joints = [
                PlacedFreedom(
                    a / np.linalg.norm(a), rng.integers(-2, 3, 3) * 1.1e-16, 0.0, f"{k}", Passive()
                )
                for k, a in enumerate(axes)
            ]
            return PlacedLeg(name, tuple(joints), np.zeros(3))

        legs = leg("a", 3), leg("b", 1)
        result = rs.stiffness(Snapshot("five-bar", legs, np.array([-0.06, 0.05, 0.45])))
        expected = Status.RIGID_DIRECTION | Status.FREE_MOTIONS
        assert (result.status, int(result.rank)) == (expected, 5), seed


@pytest.mark.parametrize("by", [0.0, 1e-15, -2e-15])
def test_lever_arms_that_are_rounding_decide_nothing(by):
    """Hinges alike through one point; its coordinates differ in the last digits."""
    from robostiff.model import Passive

    at, axis = np.array([0.7, -0.04, -0.8]), np.array([0.48, 0.0, 0.64]) / 0.8
    drive = PlacedFreedom(np.array([0.0, 1.0, 0.0]), at, 0.0, "drive", Actuated(1e5))
    hinge = PlacedFreedom(axis, at * (1 + by), 0.0, "hinge", Passive())
    other = replace(hinge, point=at * (1 - by), name="other")
    snapshot = Snapshot("point", (PlacedLeg("leg", (drive, hinge, other), at),), at + 0.3)
    result = rs.stiffness(snapshot)
    expected = Status.REDUNDANT_JOINTS | Status.RIGID_DIRECTION | Status.FREE_MOTIONS
    assert (result.status, int(result.rank)) == (expected, 5)
