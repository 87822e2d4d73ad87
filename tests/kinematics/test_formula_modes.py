"""The two ways of a universal joint: those of home are recorded, and nothing is selected."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity
from robostiff.kinematics import PostureFinder, leg_compliance
from robostiff.kinematics.formula import place_leg
from robostiff.model import Element, Joint
from robostiff.record import Operation
from tests.generators.elements import BAR, ROD, STEEL
from tests.generators.legs import DRIVE, FREE, LegCase, near_home
from tests.kinematics.recorded_legs import (
    Pair,
    at_samples,
    built_leg,
    difference,
    pair_of,
    recorded_pose,
)

UP = np.array([0.0, 0.0, 1.0])
FLAT_BAR = rs.beam_link(0.3 * UP, STEEL, BAR, y_axis=np.array([1.0, 0, 0]))
OBLIQUE_BAR = rs.beam_link(0.3 * UP, STEEL, BAR, y_axis=np.array([1.0, 2.0, 0]))
BENT = (
    rs.beam_link(np.array([0.1, 0.0, 0.2]), STEEL, ROD),
    rs.beam_link(np.array([-0.1, 0.0, 0.2]), STEEL, ROD),
)
_SQUARE = 1e-4 * np.random.default_rng(0).normal(size=(6, 6))
ANY_SPRING = rs.Link(np.zeros(3), Elasticity(_SQUARE @ _SQUARE.T), np.eye(3))
SLIDING_SPRING = rs.Link(
    np.zeros(3),
    Elasticity(np.diag([0, 1e-8, 1e-8, 0, 0, 0]), np.array([[1.0, 0, 0, 0, 0, 0]]).T),
    np.eye(3),
)
TILTED_SPRING = rs.Link(
    np.zeros(3), Elasticity(np.zeros((6, 6)), np.array([[1.0, 0, 1.0, 0, 0, 0]]).T), np.eye(3)
)
HINGE_ACROSS = rs.revolute([1, 0, 0], rs.Locked(1e4))
HINGE_OBLIQUE = rs.revolute([1, 0, 1], rs.Locked(1e4))

RIGHT_ANGLED = rs.universal([1, 0, 0], [0, 1, 0], FREE, home=[0.2, -0.3])
SKEWED = rs.universal([1, 0.4, 0.3], [0.2, 1, 0.3], FREE, home=[0.2, -0.3])


def ups(joint: Joint, rod: tuple[Element, ...], last: Joint) -> LegCase:
    """A strut with some rod."""
    return built_leg([joint, *rod, rs.prismatic(UP, DRIVE, home=[0.4]), last])


def far_poses(case: LegCase) -> np.ndarray:
    """Poses on both sides of where the nearer way changes."""
    rng = np.random.default_rng(0)
    return np.array([case.pose_at(near_home(case, rng, 2.0)) for _ in range(16)])


def agrees(pair: Pair) -> bool:
    both = zip(pair.recorded, pair.computed, pair.reached, strict=True)
    return all(difference(a, b) <= 1e-10 for a, b, reached in both if reached)


@pytest.mark.parametrize(
    "case",
    [
        ups(RIGHT_ANGLED, (FLAT_BAR, ANY_SPRING), rs.spherical(FREE)),
        ups(RIGHT_ANGLED, BENT, rs.spherical(FREE)),
        ups(RIGHT_ANGLED, (OBLIQUE_BAR, HINGE_OBLIQUE), rs.spherical(FREE)),
        ups(SKEWED, (FLAT_BAR,), rs.spherical(FREE)),
        ups(SKEWED, BENT, rs.spherical(FREE)),
        ups(rs.spherical(FREE), BENT, rs.universal([1, 0.2, 0], [0, 1, 0.3], FREE)),
        ups(rs.spherical(FREE), (ANY_SPRING,), rs.universal([1, 0, 0], [0, 1, 0], FREE)),
    ],
)
def test_the_way_of_home_is_recorded_and_no_other(case: LegCase):
    poses = far_poses(case)
    pair = pair_of(case, poses)
    assert pair.reached.sum() >= 8
    assert agrees(pair)
    (solver,) = PostureFinder(case.robot).solvers
    assert solver.closed_form is not None
    mode = solver.closed_form.mode
    other = replace(mode, first=-mode.first, second=-mode.second)
    turned = replace(solver, closed_form=solver.closed_form.in_mode(other))
    record, pose = recorded_pose(poses)
    legs = at_samples(place_leg(case.leg, pose, turned).leg, len(poses))
    assert not agrees(replace(pair, record=record, recorded=legs))


@pytest.mark.parametrize("rod", [(FLAT_BAR,), (OBLIQUE_BAR, HINGE_ACROSS)])
@pytest.mark.parametrize(
    ("first", "last"),
    [
        (RIGHT_ANGLED, rs.spherical(FREE)),
        (RIGHT_ANGLED, rs.universal([1, 1, 0], [-1, 1, 0], FREE)),
        (rs.spherical(FREE), rs.universal([1, 1, 0], [-1, 1, 0], FREE)),
    ],
)
def test_nothing_is_selected_at_a_pose(rod: tuple[Element, ...], first: Joint, last: Joint):
    case = ups(first, rod, last)
    pair = pair_of(case, far_poses(case))
    assert agrees(pair)
    used = {operation for operation, _, _ in pair.record.operations}
    assert Operation.GREATER not in used


@pytest.mark.parametrize("seed", range(3))
def test_the_spin_of_a_rod_between_two_balls_is_free(seed: int):
    """Only a force along the rod passes, and meets the same compliance however the rod is spun."""
    case = ups(rs.spherical(FREE), (*BENT, FLAT_BAR), rs.spherical(FREE))
    rng = np.random.default_rng(seed)
    poses = np.array([case.pose_at(near_home(case, rng, 0.5)) for _ in range(4)])
    pair = pair_of(case, poses)
    for recorded, computed in zip(pair.recorded, pair.computed, strict=True):
        A = next(recorded.freedoms).point
        d = (computed.end - A) / np.linalg.norm(computed.end - A)
        along = np.concatenate([d, np.zeros(3)])
        # a force along the rod, about A
        one, other = (along @ leg_compliance(leg, A) @ along for leg in (recorded, computed))
        assert np.isclose(one, other, rtol=1e-10, atol=0)


def test_the_spin_counts_where_a_ball_is_driven():
    case = ups(rs.spherical(rs.Actuated(1e3)), (OBLIQUE_BAR,), rs.spherical(FREE))
    assert agrees(pair_of(case, far_poses(case)))


@pytest.mark.parametrize("at_near_end", [True, False])
def test_springs_between_the_two_axes_of_a_joint(at_near_end: bool):
    """Two revolute joints through one point are a universal joint, whatever lies between."""
    two = (rs.revolute([1, 0, 0], FREE, home=[0.2]), ANY_SPRING, rs.revolute([0, 1, 0], FREE))
    slide = rs.prismatic(UP, DRIVE, home=[0.6])
    ball = rs.spherical(FREE)
    elements = (*two, slide, FLAT_BAR, ball) if at_near_end else (ball, slide, FLAT_BAR, *two)
    case = built_leg(elements)
    pair = pair_of(case, far_poses(case))
    assert pair.reached.all()
    assert agrees(pair)


@pytest.mark.parametrize("lock_stiffness", [None, 1e4])
def test_locked_joints_stay_at_home(lock_stiffness: float | None):
    lock = rs.revolute([1, 2, 0], rs.Locked(lock_stiffness), home=[0.1])
    axes = (rs.revolute([1, 0, 0], FREE), lock, rs.revolute([0, 1, 0], FREE))
    slide = rs.prismatic(UP, DRIVE, home=[0.6])
    case = built_leg([*axes, slide, FLAT_BAR, lock, rs.spherical(FREE)])
    pair = pair_of(case, far_poses(case))
    assert pair.reached.sum() >= 8
    assert agrees(pair)
