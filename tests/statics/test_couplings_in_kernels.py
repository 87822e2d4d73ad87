"""Coupled joints, and springs between legs, in kernels under load.

Against Newton's method in numbers at many poses, and at one against the energy of bodies in the
world, which shares nothing with either.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.model import Coupling, Locked, Robot
from tests.campaign.minima import least
from tests.cases.metric import distance
from tests.robots.test_coupled_joints import CASES, arm, tripod
from tests.statics.robots_under_load import bodies_of, on, same_as_each, spring

COUNT = 5
FORCE = np.array([12.0, -8, 6, 2, 1.5, -3])
HEAVE = np.array([0.5, 0, 0])
# Of legs without beams, between two of them; on links that no joint of a leg follows, and on the
# platform; so that all legs are solved together with a slack one.
SPRINGS = (
    spring(on("leg0/elbow", 0.05, 0, 0.02), on("leg1/crank", 0.02), stiffness=3e3, free_length=0.1),
    spring(on("leg1/elbow", 0.02), on("base", 0.1, 0.1), stiffness=2e3, free_length=0.05),
)
equilibrium: Any = rs.equilibrium


def turned(robot: Robot, count: int = COUNT) -> rs.JointCoordinates:
    """Coordinates of an arm around home; sums that are held stay."""
    chain = robot.legs[0].chain
    shift = 0.1 * np.random.default_rng(3).uniform(-1, 1, (count, chain.size))
    return rs.JointCoordinates(chain.home + shift * chain.free)


def check(robot: Robot, pose: Any, force: np.ndarray = FORCE, **given: Any) -> None:
    """A kernel against equilibria."""
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS, **given)
    wrench = force * np.random.default_rng(8).uniform(-1, 1, (COUNT, 6))
    answer, sure = fast.evaluate(pose, wrench), equilibrium(robot, pose, wrench, **given)
    assert fast.verified
    assert not np.any(answer.guarded)
    same_as_each(answer, sure, rtol=1e-10)


@pytest.mark.parametrize("case", ["gear", "belt", "two motors", "train"])
def test_arms_with_coupled_joints(case: str):
    robot = arm(*CASES[case])
    check(robot, turned(robot))


def test_loads_and_preloads_beside_couplings():
    """By the names of the joint that follows, and of what couples it."""
    robot = arm(*CASES["two motors"])
    loads = {"arm/left motor": [5.0, -20, 30], "arm/b": [3.0, 4, 5]}
    check(robot, turned(robot), loads=loads, gravity="-z", preload={"arm/right motor": 40.0})


def test_ratios_are_parameters():
    """A coupling whose factor and stiffness are symbols, at values other than its own."""

    def belt(ratio: Any, k: Any, **more: Any) -> Robot:
        return arm((Coupling((("b", 1), ("a", ratio)), Locked(k), 0, name="belt"),), **more)

    ratio, k = sp.symbols("ratio k")
    robot = belt(ratio, k, nominal={"ratio": 1.5, "k": 5e4})
    fast = rs.compile_loaded(robot, parameters=("ratio", "k"), backend=rs.Backend.ARRAYS)
    other = belt(1.2, 3e4)
    home = rs.JointCoordinates(other.legs[0].chain.home[None])
    K = fast.evaluate(home, FORCE, parameters={"ratio": 1.2, "k": 3e4}).K
    assert distance(np.squeeze(K), equilibrium(other, home, FORCE).K[0]) < 1e-10


@pytest.mark.parametrize("springs", [(), SPRINGS], ids=["gears", "springs between legs"])
def test_they_are_the_least_energy_of_bodies(springs: tuple[rs.BodySpring, ...]):
    robot = replace(tripod((1e4, 2e4, 3e4), geared=True), springs=springs)
    exact = least(bodies_of(robot, HEAVE), 10 * FORCE)
    fast = rs.compile_loaded(robot, beams=rs.Linear(), backend=rs.Backend.ARRAYS)
    answer = fast.evaluate(HEAVE[None], 10 * FORCE)
    assert not np.any(answer.guarded)
    assert distance(np.squeeze(answer.K_total), exact.K_total) < 1e-10
    assert np.allclose(answer.displacement[0], exact.displacement, rtol=1e-10, atol=1e-14)
