"""Deflection under a load: energy, statics, linearity, parallel blocks, what nothing holds."""

import numpy as np
import pytest

import robostiff as rs
from robostiff import NoAnswerError, Status, deflection, stiffness
from robostiff.analysis import questions, snapshot_stiffness
from robostiff.kinematics import PostureFinder, find_posture
from robostiff.model import Actuated, PlacedBlock, PlacedSpring
from robostiff.spatial import move_twist, move_wrench
from tests.generators.kernel_robots import robot_called
from tests.generators.machines import case_b, elbow_arm

LOAD = np.array([120.0, -40, 300, 12, -7, 5])


def test_actuator_loads_of_a_serial_arm_by_virtual_work():
    robot = elbow_arm()
    bent = deflection(robot, wrench=LOAD)
    snapshot = find_posture(robot).snapshot.one(0)
    freedoms = list(snapshot.legs[0].freedoms)
    assert all(isinstance(freedom.role, Actuated) for freedom in freedoms)
    for freedom, actuator in zip(freedoms, bent.actuators, strict=True):
        arm = snapshot.reference_point - freedom.point
        moment = freedom.axis @ (LOAD[3:] + np.cross(arm, LOAD[:3]))
        assert np.isclose(actuator.load, moment, rtol=1e-12, atol=1e-12)
        assert np.isclose(actuator.travel, moment / 1e5, rtol=1e-12, atol=1e-18)


def test_a_load_on_a_free_motion_has_no_number():
    robot, apex = rs.load("gough-stewart-a"), 0.8 + 0.8 * 0.3 / (0.5 - 0.3)
    spin = deflection(robot, wrench=[0, 0, 0, 0, 0, 1.0])
    assert Status.UNBALANCED in spin.status
    assert not spin.has_answer
    assert spin.parts == ()
    with pytest.raises(NoAnswerError, match="runs away"):
        _ = spin.twist
    with pytest.raises(NoAnswerError):
        _ = spin.energy
    assert any("does no work on free motions" in line for line in spin.advice)
    # a force through the apex turns nothing
    through = deflection(robot, wrench=[10.0, 20, 30, 0, 0, 0], at=[0, 0, apex])
    assert through.has_answer
    assert Status.UNBALANCED not in through.status
    K = through.stiffness.K
    assert np.allclose(K @ through.twist, [10.0, 20, 30, 0, 0, 0], rtol=0, atol=1e-6)
    # of all displacements it is the least, free turns weighed by the characteristic length
    length = float(through.stiffness.length)
    t = move_twist(through.twist, through.stiffness.origin - np.array([0, 0, apex]))
    for motion in stiffness(robot).details().free_motions:
        s = np.array([1, 1, 1, length, length, length])
        assert abs((motion * s) @ (t * s)) <= 1e-12 * np.linalg.norm(t * s)


def test_rigid_drives_store_no_energy():
    robot = elbow_arm(drives=None)
    bent = deflection(robot, wrench=LOAD)
    assert {part.part for part in bent.parts} == {"beam1", "beam2"}
    assert all(actuator.travel == 0.0 for actuator in bent.actuators)


def test_no_load_no_energy():
    bent = deflection(case_b(), wrench=np.zeros(6))
    assert not bent.twist.any()
    assert bent.energy == 0.0
    assert all(part.share == 0.0 for part in bent.parts)


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
    energies = [part.energy for part in bent.parts]
    assert np.all(np.diff(energies) <= 1e-9 * bent.energy)  # those of equal parts up to rounding
    assert min(energies) >= -1e-12 * max(energies)


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
