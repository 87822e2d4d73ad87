"""Robots that the campaign found, through every way."""

import warnings
from pathlib import Path

import pytest

import robostiff as rs
from tests.campaign import ways

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
    "parallel-63-recursive": ("recursive", "saddle-point", "verify"),
    "planar-rigid-branch": ("file",),
    "recursive-digits": ("recursive",),
    "reference-far-away": ("network",),
    "rigid-beside-soft": ("compliance", "deflection"),
    "rigid-but-for-rounding": ("compliance",),
    "saddle-point-digits": ("saddle-point",),
    "saddle-point-singular": ("saddle-point", "block", "recursive"),
    "thin-8-compliance": ("compliance",),
    "thin-88-network": ("network", "energy"),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_ways_agree_with_the_reference(name):
    snapshot, asked = rs.load(FOUND / f"{name}.json"), frozenset(ROBOTS[name])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        judge, taken = ways.judged(snapshot, [0], asked)
    assert not judge.complaints, [str(complaint) for complaint in judge.complaints]
    assert asked <= set(taken)
