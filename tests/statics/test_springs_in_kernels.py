"""Springs between bodies in kernels under load: the same as Newton's method in numbers has."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.kinematics import posture_finder
from tests.statics.robots_under_load import same_as_each

COUNT = 8
equilibrium: Any = rs.equilibrium


def spring(first: rs.BodyPoint, second: rs.BodyPoint, **values: Any) -> rs.BodySpring:
    return rs.BodySpring(f"{first.body} {second.body}", (first, second), **values)


def on(body: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> rs.BodyPoint:
    return rs.BodyPoint(body, [x, y, z])


# Bodies of an arm, its base and its platform; of legs that were struts without, under gravity; of
# the plane; and of the parallel blocks of legs, before them and behind.
UPPER, TOOL = on("arm/upper arm", 0, 0.1, 0.1), on("platform", 0, 0, 0.05)
ROBOTS = {
    "six-joint-arm": (
        spring(on("base", 0.1, 0, 0.2), UPPER, stiffness=2e4, free_length=0.1),
        spring(UPPER, TOOL, stiffness=1e4, preload=300.0),
        spring(TOOL, on("base", 0.5, 0.5, 0.5), stiffness=5e4, free_length=0.0),
    ),
    "hexapod": (
        spring(on("base", 0.1, 0, 0), on("platform", 0, 0.1, 0), stiffness=2e5, preload=2e3),
        spring(on("leg2/strut", 0.02), on("base", 0.5, 0.5, 0.3), stiffness=1e5, free_length=0.2),
    ),
    "3-rpr-beams": (
        spring(on("base", 0.1, 0.1), on("platform", 0.02, 0.03), stiffness=3e4, preload=-100.0),
        spring(on("leg1/strut", 0, 0.02), on("platform", 0.02), stiffness=1e4, free_length=0.1),
    ),
    "orthoglide": (
        spring(on("leg-x/parallelogram"), on("base", 0.4, 0.3, 0.2), stiffness=3e3, preload=20.0),
        spring(on("leg-y/drive", 0, 0.1), TOOL, stiffness=2e3, free_length=0.05),
        spring(on("leg-x/parallelogram"), on("leg-y/drive", 0, 0.1), stiffness=3e3, preload=20.0),
    ),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_they_are_equilibria_at_many_poses(name: str):
    robot = replace(rs.load(name), springs=ROBOTS[name])
    gravity = "-z" if name == "hexapod" else None
    fast = rs.compile_loaded(robot, gravity=gravity, backend=rs.Backend.ARRAYS)
    finder, random = posture_finder(robot), np.random.default_rng(4)
    length, scale = finder.length, np.where(np.array(robot.space.rows) < 3, 1.0, finder.length)
    pose: Any
    if robot.is_posed_by_joints:
        chain = robot.legs[0].chain
        pose = rs.JointCoordinates(chain.home + 0.2 * random.uniform(-1, 1, (COUNT, chain.size)))
    else:
        places = robot.coordinate_places
        spread = 0.04 * np.where(np.array(places) < 3, length, 2.0)
        pose = finder.home_pose[places] + spread * random.uniform(-1, 1, (COUNT, len(places)))
    C = rs.compliance(robot.with_springs()) * np.outer(scale, scale)
    force = 3e-4 * length / np.abs(C).max()
    wrench = force * scale * random.uniform(-1, 1, (COUNT, robot.space.size))
    answer = fast.evaluate(pose, wrench)
    sure = equilibrium(robot, pose, wrench, gravity=gravity)
    without = equilibrium(robot.with_springs(), pose, wrench, gravity=gravity)
    assert fast.verified
    assert np.count_nonzero(answer.guarded) <= 1
    same_as_each(answer, sure, rtol=0, atol=1e-11 * min(length, 1.0))
    for one, other in zip(sure, without, strict=True):
        size = np.sqrt(np.diag(one.K))
        assert np.abs((other.K - one.K) / np.outer(size, size)).max() > 1e-5  # they matter


def test_margins_are_those_beside_springs_without_tension():
    # A spring that resists heave without load is turned aside by a push, and does no longer.
    robot = rs.load("gough-stewart-b")
    home, K = rs.find_posture(robot).pose[0], rs.stiffness(robot).K
    below = on("base", *(home[:3] - [0, 0, 0.05]))
    own = spring(below, on("platform"), stiffness=5 * K[2, 2], free_length=0.05)
    robot = replace(robot, springs=(own,))
    fast = rs.compile_loaded(robot, backend=rs.Backend.ARRAYS)
    wrenches = np.zeros((9, 6))
    wrenches[:, 0] = K[0, 0] * np.linspace(0, 0.06, 9)
    margins = equilibrium(robot, home, wrenches).margin
    guarded = fast.evaluate(np.tile(home, (9, 1)), wrenches).guarded
    assert np.array_equal(guarded, margins < 0.3)
    assert np.count_nonzero(guarded) == 5
