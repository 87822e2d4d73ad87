"""Coupled joints under finite loads: against bodies in the world, and networks."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import find_posture
from robostiff.model import Actuated, Passive
from robostiff.network import network_of_snapshot
from tests.campaign.bodies import curvatures, elastic_energy
from tests.campaign.minima import least
from tests.cases.metric import distance
from tests.robots.test_coupled_joints import CASES, LENGTH, POSES, arm, tripod
from tests.statics.robots_under_load import bodies_of, loaded

F = np.array([120.0, -80, 60, 20, 15, -30])
SPRINGS = {"beams": rs.Linear()}
K_OF_TRIPOD = (1e4, 2e4, 3e4)


# A joint of these turns without resistance: they swing far, to where a load does no work.
FREE = ("belt on a rigid drive", "gear without drive", "motor and gear", "driven follower")


@pytest.mark.parametrize("case", [case for case in CASES if case not in FREE])
def test_an_arm_is_that_of_the_energy_of_its_bodies(case: str):
    robot = arm(*CASES[case])
    own = bodies_of(robot)
    exact, answer = least(own, F), loaded(robot, wrench=F, **SPRINGS)
    assert str(answer.status) == "ok"
    assert answer.stable == (curvatures(own.bodies, exact.state)[0] > 0)
    assert np.abs(answer.displacement).max() > 2e-3
    assert np.allclose(answer.displacement, exact.displacement, rtol=1e-9, atol=1e-12)
    assert distance(answer.K_total, exact.K_total) < 1e-9
    assert np.isclose(answer.energy, elastic_energy(own.bodies, exact.state), rtol=1e-9)
    network = network_of_snapshot(find_posture(robot).snapshot.one(0))
    same = loaded(network, wrench=F, **SPRINGS)
    assert np.allclose(same.displacement, answer.displacement, rtol=1e-9, atol=1e-12)
    assert distance(same.K, answer.K) < 1e-9


def test_geared_cranks_are_slides_at_rest_and_vibrate_so():
    robot = tripod(K_OF_TRIPOD, geared=True)
    slides = find_posture(tripod(K_OF_TRIPOD, geared=False), POSES[1:2]).coordinates
    a = np.arccos(np.array([q[0, 1] for q in slides]) / (2 * LENGTH))
    twin = tripod(np.array(K_OF_TRIPOD) / (2 * LENGTH * np.sin(a)) ** 2, geared=False)
    assert distance(loaded(robot, pose=POSES[1]).K, loaded(twin, pose=POSES[1]).K) < 1e-8
    heavy = {"platform": rs.Mass(20.0, inertia=[1.0, 1.5, 2.0])}
    found, same = (rs.modes(own, POSES[1], heavy).frequencies for own in (robot, twin))
    assert np.allclose(found, same, rtol=1e-8)


def test_the_geared_tripod_far_from_rest():
    """The crank follows ``k q = F_s ds/dq`` of the slide; all cranks alike go up together."""
    k, down = 2e4, np.array([0, 0, -3e3, 0, 0, 0])
    robot = tripod((k, k, k), geared=True)
    exact = least(bodies_of(robot), down)
    answer = loaded(robot, wrench=down, **SPRINGS)
    assert np.allclose(answer.displacement, exact.displacement, atol=1e-10)
    assert abs(answer.displacement[2]) > 1e-3
    assert distance(answer.K_total, exact.K_total) < 1e-8
    for leg in ("leg0", "leg1", "leg2"):
        parts = {part.part: part for part in answer.parts if part.leg == leg}
        assert np.isclose(parts["elbow"].motion[0], -2 * parts["crank"].motion[0], rtol=1e-12)
        gear = parts["coupling of elbow and crank"]
        assert abs(gear.motion[0]) < 1e-12
        # the crank holds what the load and the gear do along its coordinate
        assert gear.energy == 0
        assert gear.load is not None
        assert abs(gear.load) > 1.0


def test_preloads_and_laws_of_motors():
    """A preload of a motor moves its sum by f/k where nothing else acts; a law takes its place."""
    robot = arm(*CASES["two motors"])
    pushed = loaded(robot, preload={"arm/right motor": 40.0})
    motor = next(part for part in pushed.parts if part.part == "right motor")
    assert np.isclose(motor.motion[0], 40.0 / 2e4, rtol=1e-12)
    assert motor.load is not None
    assert abs(motor.load) < 1e-9
    assert np.isclose(pushed.potential, -0.5 * 40.0**2 / 2e4, rtol=1e-9)
    q = __import__("sympy").Symbol("q")
    law = {"arm/right motor": rs.ForceLaw(2e4 * q + 1e7 * q**3)}
    pushed = loaded(robot, preload={"arm/right motor": 400.0}, laws=law)
    motor = next(part for part in pushed.parts if part.part == "right motor")
    s = float(motor.motion[0])
    assert np.isclose(2e4 * s + 1e7 * s**3, 400.0, rtol=1e-9)
    with pytest.raises(rs.InputError, match="a rigid drive holds"):
        loaded(arm(*CASES["gear"]), preload={"arm/coupling of b and a": 1.0})


def test_weights_at_the_body_behind_a_coupled_joint():
    """By the name of the joint, or of the coupling in its place."""
    wrist = rs.load("examples/bevel-wrist.yaml")
    sunk = [
        loaded(wrist, loads={f"arm/{name}": rs.Mass(12.0)}).displacement
        for name in ("elbow", "belt")
    ]
    assert np.array_equal(sunk[0], sunk[1])
    assert sunk[0][2] < -1e-4
    found = [
        rs.modes(wrist, masses={f"arm/{name}": 12.0}).frequencies for name in ("elbow", "belt")
    ]
    assert np.allclose(*found, rtol=1e-12)


def test_a_motion_that_a_differential_leaves_free():
    """One motor of two holds the sum of tilt and roll alone: as `stiffness` says."""
    wrist = arm((rs.Coupling((("b", 1.0), ("c", 1.0)), Actuated(1e4)),), None, Passive())
    linear, answer = rs.stiffness(wrist), loaded(wrist)
    assert rs.Status.FREE_MOTIONS in linear.status
    assert str(answer.status) == "free-motions"
    assert distance(answer.K, linear.K) < 1e-9
