"""Legs recorded at joint coordinates: serial arms, and legs closed elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from robostiff import load
from robostiff.kinematics import place_chain
from robostiff.kinematics.formula import place_leg_at_joints
from robostiff.model import Chain, Leg, PlacedLeg, revolute, spherical
from tests.generators.legs import FREE, PLANAR, RODS, STRUTS, near_home, random_leg
from tests.kinematics.recorded_legs import at_samples, difference, recording


def check(leg: Leg, q: np.ndarray) -> None:
    """Compare a leg at coordinates (N, size) with the same leg in floats."""
    record = recording({f"q{i}": own for i, own in enumerate(q.T)})
    formula = place_leg_at_joints(leg, np.array([record.input(name) for name in record.inputs]))
    for recorded, own in zip(at_samples(formula.leg, len(q)), q, strict=True):
        placed = place_chain(leg.chain, own, leg.base.R, leg.base.p)
        computed = PlacedLeg(leg.name, placed.elements, placed.p)
        assert difference(recorded, computed) <= 1e-12
        assert np.allclose(recorded.end, placed.p, rtol=0, atol=1e-14)
    assert formula.gap == ()
    assert [formula.coordinate(i).sample.tolist() for i in range(q.shape[1])] == q.T.tolist()


@pytest.mark.parametrize("name", ["six-joint-arm", "two-link-arm", "planar-link", "tripteron"])
def test_shipped_robots(name: str):
    robot = load(name)
    leg = robot.legs[0]
    rng = np.random.default_rng(0)
    check(leg, leg.chain.home + rng.uniform(-1, 1, (5, leg.chain.size)) * leg.chain.free)


@pytest.mark.parametrize("kind", STRUTS + RODS + PLANAR)
def test_random_legs(kind: str):
    case = random_leg(kind, 7)
    rng = np.random.default_rng(7)
    check(case.leg, np.array([near_home(case, rng, 0.4) for _ in range(4)]))


def test_spherical_joints_by_their_rotation_vectors():
    arm = random_leg("SPS", 3).leg
    rng = np.random.default_rng(3)
    elements = [spherical(FREE), *arm.chain.elements, revolute([1, 2, 2], FREE)]
    leg = replace(arm, chain=Chain(tuple(elements)))
    q = rng.uniform(-2, 2, (4, leg.chain.size))
    q[0] = 0.0
    q[:, 6] = 0.7  # the slide
    check(leg, q)


def test_lengths_of_the_beams_of_a_telescope():
    robot = load("hexapod")
    leg = robot.legs[0]
    q = np.tile(leg.chain.home, (3, 1))
    q[:, 2] = [0.2, -0.1, 0.4]
    record = recording({f"q{i}": own for i, own in enumerate(q.T)})
    formula = place_leg_at_joints(leg, np.array([record.input(name) for name in record.inputs]))
    (length,) = formula.lengths
    assert np.allclose(length.sample, [0.2, -0.1, 0.4])
