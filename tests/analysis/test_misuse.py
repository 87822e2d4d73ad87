"""Calls that cannot mean anything, each with the line to write instead."""

from dataclasses import replace

import numpy as np

import robostiff as rs
from robostiff.model import Actuated, Joint

HEXAPOD = rs.load("hexapod")
POSE = [0.06, 0.02, 0.9, 0, 0.1, 0]


def test_read_only_and_broadcast_poses_are_fine():
    poses = np.broadcast_to(POSE, (4, 6))
    np.testing.assert_allclose(rs.stiffness(HEXAPOD, poses).K[3], rs.stiffness(HEXAPOD, POSE).K)


def test_results_show_themselves_in_a_line():
    result = rs.stiffness(HEXAPOD, POSE)
    assert repr(result).startswith("<Stiffness of 'hexapod' about (0.06, 0.02, 0.9) m, rank 6")
    assert "2 poses, 2 with a matrix" in repr(rs.stiffness(HEXAPOD, [POSE, POSE]))
    assert "status ok" in repr(rs.deflection(HEXAPOD, POSE, [1, 0, 0, 0, 0, 0]))


def test_a_far_reference_point_changes_no_rank_and_no_status():
    robot = rs.load("gough-stewart-b-beams")
    assert isinstance(robot, rs.Robot)
    near = rs.stiffness(robot)
    for distance in (1e2, 1e4, 1e6):
        far = rs.stiffness(replace(robot, reference_point=np.array([distance, 0, 0])))
        assert str(far.status) == "ok"
        assert int(far.rank) == 6
        np.testing.assert_allclose(far.K[:3, :3], near.K[:3, :3], rtol=1e-9, atol=1e-3)


def test_free_motions_described_from_far_away_are_the_same():
    robot = rs.load("gough-stewart-a")
    words = [str(motion) for motion in rs.stiffness(robot, at=[0, 0, 1e8]).free_motions]
    assert words == [f"rotation about {axis} through (0, 0, 2) m" for axis in "xyz"]


def test_stiffnesses_too_far_apart_are_said_to_be():
    robot = rs.load("gough-stewart-b")
    assert isinstance(robot, rs.Robot)
    chain = robot.legs[0].chain
    stiff = tuple(
        replace(e, role=Actuated(1e24)) if e.name == "actuator" and isinstance(e, Joint) else e
        for e in chain.elements
    )
    leg = replace(robot.legs[0], chain=replace(chain, elements=stiff))
    result = rs.stiffness(replace(robot, legs=(leg, *robot.legs[1:])))
    assert "ill-conditioned" in str(result.status)
