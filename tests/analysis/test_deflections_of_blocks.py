"""Deflection of robots with parallel blocks: energies, reactions, finite differences."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analysis import questions, snapshot_stiffness
from robostiff.kinematics import PostureFinder
from robostiff.model import PlacedBlock, PlacedSpring
from robostiff.spatial import move_wrench
from tests.generators.kernel_robots import robot_called

NAMES = ("orthoglide", "delta", "pairs of struts", "four-bar legs", "nested parallelograms")


def loaded(name: str):
    robot = robot_called(name)
    home = PostureFinder(robot).home_pose[robot.coordinate_places]
    pose = home + 0.03 * np.random.default_rng(6).uniform(-1, 1, len(home))
    F = np.array([120.0, -80.0, 60.0, 3.0, -4.0, 5.0])[list(robot.space.rows)]
    return robot, pose, F


@pytest.mark.parametrize("name", NAMES)
def test_shares_of_energy_sum_to_one_and_energies_to_the_work(name):
    robot, pose, F = loaded(name)
    bent = rs.deflection(robot, pose, F)
    assert sum(part.share for part in bent.parts) == pytest.approx(1.0)
    assert sum(part.energy for part in bent.parts) == pytest.approx(bent.energy, rel=1e-9)
    assert bent.energy == pytest.approx(0.5 * F @ rs.compliance(robot, pose) @ F, rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_branches_of_a_block_carry_together_what_the_leg_carries(name):
    """Reactions of all legs, cut inside every outer block, balance the load."""
    robot, pose, F = loaded(name)
    bent = rs.deflection(robot, pose, F)
    snapshot = rs.find_posture(robot, pose).snapshot.one(0)
    at = snapshot.reference_point
    reactions = {(r.leg, r.joint): r for r in bent.reactions}
    total = np.zeros(6)
    for leg in snapshot.legs:
        (block,) = (e for e in leg.elements if isinstance(e, PlacedBlock))
        for branch in _cut(block):
            first = next(f for f in branch.elements if not isinstance(f, PlacedSpring))
            reaction = reactions[leg.name, first.name]
            total += move_wrench(reaction.wrench, at - reaction.point)
    assert np.abs(total[list(robot.space.rows)] - F).max() < 1e-8 * np.abs(F).max()


def _cut(block: PlacedBlock):
    """Branches that have a joint of their own, those of blocks further inside among them."""
    for branch in block.branches:
        if any(isinstance(e, PlacedBlock) for e in branch.elements):
            for inner in branch.blocks:
                yield from _cut(inner)
        else:
            yield branch


@pytest.mark.parametrize("name", ["delta", "nested parallelograms"])
def test_poses_worked_out_together_share_loads_as_each_alone(name, monkeypatch):
    """In chunks of two poses, whose blocks are joined; of one pose legs are solved together."""
    monkeypatch.setattr(questions, "CHUNK", 2)
    robot, pose, F = loaded(name)
    poses = pose + 0.01 * np.arange(3)[:, None]
    for one, bent in zip(poses, rs.deflection(robot, poses, F), strict=True):
        alone = rs.deflection(robot, one, F)
        energies = {(part.leg, part.part): part.energy for part in alone.parts}
        assert {(p.leg, p.part): p.energy for p in bent.parts} == pytest.approx(energies, rel=1e-8)
        for own, other in zip(bent.reactions, alone.reactions, strict=True):
            assert np.allclose(own.wrench, other.wrench, rtol=1e-8, atol=1e-8 * np.abs(F).max())


def test_blocks_are_solved_once_for_stiffness_and_deflection(monkeypatch):
    solved = []
    inner = snapshot_stiffness.block_of
    monkeypatch.setattr(
        snapshot_stiffness, "block_of", lambda *given: solved.append(1) or inner(*given)
    )
    rs.deflection(rs.load("delta"), wrench=[1, 2, 3, 0, 0, 0])
    assert len(solved) == 1  # three legs that are alike, together
