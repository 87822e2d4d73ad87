"""An arm under its weight and a wrench: MuJoCo's forces, their differences and its mass matrix."""

import numpy as np
import pytest

import robostiff as rs
from tests.cases.metric import distance
from tests.statics.robots_under_load import loaded, number

pytest.importorskip("mujoco")
from tests.statics.mujoco_arm import INERTIAS, MASSES, G, arm, at_rest, centres

WRENCHES = np.array([[0.0, 0, 0, 0, 0, 0], [120.0, -80, 60, 0, 0, 0], [40.0, 90, -150, 12, -8, 15]])
WEIGHTS = {
    f"arm/j{i + 1}": rs.DeadForce([0, 0, -G * mass], centre)
    for i, (mass, centre) in enumerate(zip(MASSES, centres(), strict=True))
}
BODIES = {
    f"arm/j{i + 1}": rs.BodyMass(float(mass), centre, inertia)
    for i, (mass, centre, inertia) in enumerate(zip(MASSES, centres(), INERTIAS, strict=True))
}


@pytest.mark.parametrize("wrench", WRENCHES)
def test_equilibrium_and_stiffness(wrench: np.ndarray):
    rest = at_rest(wrench)
    answer = loaded(arm(), wrench=wrench, loads=WEIGHTS)
    assert answer.stable
    motion = np.array([number(float(part.motion[0])) for part in answer.parts])
    assert np.abs(motion).max() > 0.05  # far from small
    assert np.abs(motion - rest.q).max() < 1e-12
    assert np.abs(answer.point - rest.tip).max() < 1e-12
    assert distance(answer.K, rest.K) < 1e-9


@pytest.mark.parametrize("wrench", WRENCHES[:2])
def test_natural_frequencies_under_load(wrench: np.ndarray):
    rest = at_rest(wrench)
    found = rs.modes(arm(), masses=BODIES, wrench=wrench, loads=WEIGHTS)
    assert np.allclose(found.frequencies, rest.frequencies, rtol=1e-8)
    free = rs.modes(arm(), masses=BODIES)
    assert np.abs(free.frequencies / found.frequencies - 1).max() > 1e-3
