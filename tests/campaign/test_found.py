"""Robots that the campaign found, through every way."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import energy_stiffness, network_of_snapshot
from tests.campaign import ways
from tests.campaign.posed import nominal
from tests.cases.metric import distance

FOUND = Path(__file__).parent / "found"
#: What went wrong there: the robot, and the ways that were.
ROBOTS = {
    "aligned-but-for-the-tolerance": ("compliance",),
    "digits-of-the-input": ("compliance",),
    "doubtful-energy": ("energy", "verify"),
    "drives-29-default": ("energy",),
    "energy-near-singular": ("energy", "verify"),
    "energy-of-soft-motions": ("energy", "verify"),
    "extent-of-rounding": ("batch", "network", "energy", "millimetres"),
    "far-frame": ("frame", "millimetres", "saddle-point"),
    "no-compliance-but-for-rounding": ("compliance",),
    "nothing-held": ("block", "recursive", "verify"),
    "one-of-four-in-a-point": ("batch", "millimetres", "rounded"),
    "parallel-63-recursive": ("recursive", "saddle-point", "verify"),
    "planar-rigid-branch": ("file",),
    "recursive-digits": ("recursive",),
    "reference-far-away": ("network",),
    "rigid-beside-soft": ("compliance", "deflection"),
    "rigid-directions-almost-one": ("deflection",),
    "rigid-but-for-rounding": ("compliance",),
    "saddle-point-digits": ("saddle-point",),
    "saddle-point-singular": ("saddle-point", "block", "recursive"),
    "screw-in-one-point": ("network",),
    "small-entries-of-energy": ("energy",),
    "thin-8-compliance": ("compliance",),
    "thin-88-network": ("network", "energy"),
    "twins-in-one-point": ("rounded",),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_ways_agree_with_the_reference(name):
    asked = frozenset(ROBOTS[name])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        snapshot = rs.load(FOUND / f"{name}.json")
        judge, taken = ways.judged(snapshot, [0], asked)
    assert not judge.complaints, [str(complaint) for complaint in judge.complaints]
    assert asked <= set(taken)


@pytest.mark.parametrize("name", ["drives-29-default", "parallel-63-recursive"])
def test_second_opinions_have_digits_to_spare(name):
    """Blocks of K that differ by 10^12: which BLAS adds must not decide whether all agree."""
    snapshot = rs.load(FOUND / f"{name}.json")
    network, exact = network_of_snapshot(snapshot), ways.reference(snapshot)
    assert exact is not None
    assert exact.K is not None
    size = ways._extent(snapshot)
    assert distance(energy_stiffness(network), exact.K, size, least=1e-12) <= 1e-10
    assert distance(rs.stiffness(network).K, exact.K, size, least=1e-12) <= 1e-10


def test_a_record_that_arrives_near_home_alone_is_confirmed_there():
    """Recorded steps reach none of the poses drawn first; at nearer ones nothing differs."""
    with pytest.warns(rs.PlausibilityWarning, match="an angle of 191"):  # a screw of fine pitch
        robot = rs.load(FOUND / "closure-near-home.yaml")
    assert rs.compile(robot, backend=rs.Backend.ARRAYS).verified


def test_near_a_singular_pose_legs_close_to_the_last_digit():
    """After six steps 4e-11 were open, of which K of an arm felt a thousand times as much."""
    robot = rs.load(FOUND / "closure-near-singular.yaml")
    pose = [0.36237188075099186, 0.39945033911455646, -0.2827648901777583]
    pose += [0.03857462534235277, 0.041060177775491064, -0.14264643818568098]
    posture = rs.find_posture(robot, pose)
    assert max(posture.shift_gaps[0], posture.turn_gaps[0]) < 1e-14
    kernel = rs.compile(robot, backend=rs.Backend.ARRAYS).evaluate(np.array([pose]))
    assert not kernel.guarded[0]
    K = rs.stiffness(robot, pose).K
    assert np.allclose(kernel.values["K"][0], K, rtol=1e-10, atol=1e-11 * np.abs(K).max())


def test_a_long_first_step_from_a_home_near_singular_leads_to_no_other_posture():
    """Newton's method turned by 33 rad, then contracted to a posture of another home."""
    robot = rs.load(FOUND / "home-near-singular.yaml")
    home = rs.find_posture(robot).pose[0]
    pose = [-0.13643391270186178, -1.096162560641354, -0.2140525720716872]
    pose += [0.040543970307761336, -0.05369092283731809, -0.11923487891678533]
    q = [np.zeros(6)]
    for part in np.linspace(0.02, 1, 50):  # the way from home in small steps
        posture = rs.find_posture(robot, home + part * (pose - home), near=q)
        (last,), q = q, [posture.coordinates[0][0]]
        assert np.abs(q[0] - last).max() < 0.3
    assert rs.find_posture(robot, pose).coordinates[0][0] == pytest.approx(q[0], abs=1e-9)


def test_a_robot_of_random_decimals_has_a_formula():
    """In exact fractions its closure and elimination had more digits than Python writes out."""
    robot = rs.load(FOUND / "decimals-of-17-digits.yaml")
    K = rs.derive(robot).lambdify()()  # in named steps
    assert np.allclose(K, rs.stiffness(robot).K, rtol=1e-11, atol=1e-11 * np.abs(K).max())


def test_parameters_that_follow_from_others_do_so_when_rounded():
    """Rods of the nominal length do not reach a home that was moved."""
    given = (("R", 0.31), ("h", 0.34))
    values = nominal("us-ups", given)
    assert values["l"] == pytest.approx(np.hypot(0.31, 0.34), rel=1e-15)
    assert nominal("us-ups")["l"] != values["l"]
    assert rs.load("us-ups", values).home is not None
