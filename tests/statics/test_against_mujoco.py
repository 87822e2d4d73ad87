"""An arm under its weight and a wrench: MuJoCo's forces, their differences and its mass matrix."""

from dataclasses import replace

import numpy as np
import pytest

import robostiff as rs
from tests.cases.metric import distance
from tests.statics.robots_under_load import loaded, number

pytest.importorskip("mujoco")
from tests.statics.mujoco_arm import INERTIAS, MASSES, G, Tendon, arm, at_rest, centres

WRENCHES = np.array([[0.0, 0, 0, 0, 0, 0], [120.0, -80, 60, 0, 0, 0], [40.0, 90, -150, 12, -8, 15]])
WEIGHTS = {
    f"arm/j{i + 1}": rs.DeadForce([0, 0, -G * mass], centre)
    for i, (mass, centre) in enumerate(zip(MASSES, centres(), strict=True))
}
BODIES = {
    f"arm/j{i + 1}": rs.Mass(float(mass), point=centre, inertia=inertia)
    for i, (mass, centre, inertia) in enumerate(zip(MASSES, centres(), INERTIAS, strict=True))
}


TENDONS = (
    Tendon((0, 2), (np.array([-0.2, 0.1, 0.9]), np.array([0.2, 0, 0.5])), 900.0, 0.3),
    Tendon((2, 4), (np.array([0.1, 0, 0.55]), np.array([0.6, 0.05, 0.45])), 1500.0, 0.6),
    Tendon((0, 6), (np.array([0.9, 0.4, 1.2]), np.array([0.9, 0, 0.5])), 200.0, 0.0),
)


@pytest.mark.parametrize("wrench", WRENCHES)
@pytest.mark.parametrize("tendons", [(), TENDONS], ids=["bare", "springs between bodies"])
def test_equilibrium_stiffness_and_frequencies(wrench: np.ndarray, tendons: tuple[Tendon, ...]):
    """Springs are pulled, pushed, and of zero free length."""
    robot = replace(arm(), springs=tuple(own.placed for own in tendons))
    rest = at_rest(wrench, tendons)
    answer = loaded(robot, wrench=wrench, loads=WEIGHTS)
    assert answer.stable
    motion = np.array([number(float(part.motion[0])) for part in answer.parts])
    assert np.abs(motion).max() > 0.05  # far from small
    assert np.abs(motion - rest.q).max() < 1e-11
    assert np.abs(answer.point - rest.tip).max() < 1e-11
    assert distance(answer.K, rest.K) < 1e-9
    if wrench[3:].any():  # the stiffness under a moment of fixed direction is not symmetric
        return
    found = rs.modes(robot, masses=BODIES, wrench=wrench, loads=WEIGHTS)
    assert np.allclose(found.frequencies, rest.frequencies, rtol=1e-8)
    free = rs.modes(arm(), masses=BODIES)
    assert np.abs(free.frequencies / found.frequencies - 1).max() > 1e-3
