"""Calls that cannot mean anything, each with the line to write instead."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.errors import InputError
from robostiff.model import Actuated, Joint

HEXAPOD = rs.load("hexapod")
POSE = [0.06, 0.02, 0.9, 0, 0.1, 0]


@pytest.mark.parametrize("robot", ["hexapod", None, 3])
def test_what_is_no_robot(robot):
    for call in (rs.stiffness, rs.compliance, rs.deflection, rs.find_posture):
        with pytest.raises(InputError, match=r"^robot( of find_posture)?: "):
            call(robot)


@pytest.mark.parametrize(
    "pose",
    [
        "home", {}, [POSE, [1, 2]], [True] * 6, ["0"] * 6, np.array(POSE) + 1j, [np.nan] * 6,
        [1e200] * 6, np.ma.masked_greater(POSE, 0.5),
    ],
)  # fmt: skip
def test_what_is_no_pose(pose):
    with pytest.raises(InputError, match="pose of 'hexapod'"):
        rs.stiffness(HEXAPOD, pose)


@pytest.mark.parametrize("method", [rs.Block, "block", None, 3])
def test_what_is_no_form(method):
    with pytest.raises(InputError, match=r"write method=\w+\(\)"):
        rs.stiffness(HEXAPOD, method=method)


@pytest.mark.parametrize("tolerance", [1e-9, None, rs.Tolerance])
def test_what_is_no_tolerance(tolerance):
    with pytest.raises(InputError, match="expected a Tolerance"):
        rs.stiffness(HEXAPOD, tolerance=tolerance)


@pytest.mark.parametrize("C", [-np.eye(6), np.diag([1, 1, 1, 1, 1, -1.0])])
def test_a_compliance_with_a_negative_diagonal(C):
    with pytest.raises(InputError, match="negative"):
        rs.chain_stiffness(C, np.zeros((6, 0)))


def test_an_indefinite_compliance():
    with pytest.raises(InputError, match="semidefinite"):
        rs.chain_stiffness([[1, 2, 0], [2, 1, 0], [0, 0, 1.0]], np.zeros((3, 0)))


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


@pytest.mark.parametrize("file", ["campaign.csv", Path("campaign.csv")])
def test_measurements_by_the_name_of_their_file(file):
    with pytest.raises(InputError) as error:
        rs.identify(HEXAPOD, file, ["leg*/strut"])
    assert str(error.value) == (
        "measurements: got the name of a file, expected rs.Measurements(...); "
        "write rs.Measurements.read('campaign.csv', robot)"
    )


@pytest.mark.parametrize(
    ("word", "pose"),
    [
        ("symbolic", r"rs\.AtSymbols\(\)"),
        ("joints", r"rs\.AtJoints\(\)"),
        ("home", r"rs\.AtHome\(\)"),
        ("level", r'rs\.AtCoordinates\(\{"x": 0\.1\}\)'),
    ],
)
def test_the_pose_of_a_formula_in_a_word(word, pose):
    with pytest.raises(InputError, match=rf"got '{word}', .*; write pose={pose}$"):
        rs.derive("hexapod", pose=word)
