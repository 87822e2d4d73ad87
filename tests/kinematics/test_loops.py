"""Parallel blocks close at every pose: in closed form where branches are copies, else by Newton."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import PostureFinder
from robostiff.model import Chain, Leg, ParallelBlock, Robot
from robostiff.robots import load
from robostiff.spatial import Frame
from tests.generators.elements import shift_by
from tests.generators.kernel_robots import robot_called
from tests.generators.planted_poses import PoseSpace

COPIES = ("orthoglide", "delta", "nested parallelograms")
ITERATED = ("four-bar legs", "pairs of struts")


def robot_of(name: str) -> Robot:
    robot = robot_called(name)
    return robot


def after(first: Frame, second: Frame) -> Frame:
    """The second frame, seen from where the first is seen."""
    return Frame(first.R @ second.R, first.p + first.R @ second.p)


@pytest.mark.parametrize("name", COPIES + ITERATED)
def test_loops_close_at_random_poses(name):
    robot = robot_of(name)
    posture = rs.find_posture(robot, PoseSpace(robot).beside(20, 0.08))
    assert posture.reached.all()
    assert posture.meets(1e-11).all()


@pytest.mark.parametrize("name", COPIES + ITERATED)
def test_the_way_to_close_is_the_one_that_holds(name):
    solvers = PostureFinder(robot_of(name)).solvers
    closed = [solver.closed_form is not None for solver in solvers]
    # The slide and rod of a nested parallelogram have no platform joint: no closed form either.
    assert all(closed) if name in ("orthoglide", "delta") else not any(closed)


def test_copies_that_turn_against_each_other_are_closed_by_iteration():
    """Struts in pairs reach a turned platform, though equal coordinates would not."""
    robot = robot_of("pairs of struts")
    apart = Robot(
        "six struts",
        tuple(
            Leg(f"{leg.name} {branch.name}", after(leg.base, branch.start), branch.chain,
                after(leg.attachment, branch.end))
            for leg in robot.legs
            for block in leg.chain.elements
            if isinstance(block, ParallelBlock)
            for branch in block.branches
        ),
        home=robot.home,
    )  # fmt: skip
    pose = [0.02, 0.01, 0.6, 0.1, 0.05, -0.07]
    first, second = rs.stiffness(robot, pose), rs.stiffness(apart, pose)
    assert np.abs(first.K - second.K).max() < 1e-9 * np.abs(second.K).max()


def test_poses_may_have_different_freedoms_in_different_chunks():
    """Where a parallelogram lies flat it has one freedom more."""
    robot = load("orthoglide")
    poses = np.zeros((4097, 3))
    poses[-1] = [0, 0, 0.6]
    result = rs.stiffness(robot, poses)
    alone = rs.stiffness(robot, poses[-1])
    assert int(result.rank[0]) == 6
    assert int(result.rank[-1]) == int(alone.rank) == 5
    assert result[4096].redundant_joints == alone.redundant_joints


def test_branches_without_joints_are_one_stiff_part():
    """Two bars welded between two bodies: they stretch as one of twice the stiffness."""
    block = next(e for e in robot_of("orthoglide").legs[0].chain.elements if e.name[:5] == "paral")
    assert isinstance(block, ParallelBlock)
    bar = block.branches[0].chain.elements[1]
    welded = replace(block, branches=tuple(replace(b, chain=Chain((bar,))) for b in block.branches))
    here = shift_by(0, 0, 0)
    home = shift_by(0.6, 0, 0)
    alone, pair = (
        rs.stiffness(Robot("arm", (Leg("arm", here, Chain((e,)), here),), home=home))
        for e in (bar, welded)
    )
    assert int(pair.rank) == 6
    assert pair.K[0, 0] == pytest.approx(2 * alone.K[0, 0], rel=1e-12)
