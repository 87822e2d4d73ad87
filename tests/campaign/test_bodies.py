"""What the reference of machines under loads stands on, by hand."""

import numpy as np
import pytest

from tests.campaign.assembled import Assembly, beam_compliance
from tests.campaign.bodies import Bodies, SingleJoint, curvatures, frequencies, minimum
from tests.campaign.loaded_networks import critical_factor

L, EA, EI, GJ = 2.0, 3e7, 4e3, 3e3


def _cantilever(parts: int, spread: float = 0.0) -> Assembly:
    own = Assembly(Bodies([np.zeros(3), np.array([L, 0, 0])], L), parts)
    beam = EA, EI, EI, GJ
    start, end = np.zeros(3), np.array([L, 0, 0])
    C, none = beam_compliance(L, *beam), np.zeros((6, 0))
    body = own.elastic(0, start, end, np.eye(3), C, none, beam, spread)
    own._merged([1, body])
    return own


def test_small_deflection_of_a_cantilever():
    own = minimum(_cantilever(0).bodies, np.array([0, 1e-6, 0, 0, 0, 0]))
    assert own.displacement[1] == pytest.approx(1e-6 * L**3 / (3 * EI), rel=1e-9)
    assert own.displacement[5] == pytest.approx(1e-6 * L**2 / (2 * EI), rel=1e-9)
    assert own.compliance == pytest.approx(beam_compliance(L, EA, EI, EI, GJ), rel=1e-6, abs=1e-12)


def test_a_moment_bends_a_cantilever_to_a_circle():
    """A quarter of a circle: each part alone turns by a rotation vector."""
    M = np.pi / 2 * EI / L
    own = minimum(_cantilever(16).bodies, np.array([0, 0, 0, 0, 0, M]))
    radius = 2 * L / np.pi
    assert own.displacement[5] == pytest.approx(np.pi / 2, rel=1e-6)
    assert L + own.displacement[0] == pytest.approx(radius, rel=2e-3)
    assert own.displacement[1] == pytest.approx(radius, rel=2e-3)


def test_euler_load_of_a_cantilever():
    own, F = _cantilever(8), np.array([-EI / L**2, 0, 0, 0, 0, 0])
    assert critical_factor(own, F, 10.0) == pytest.approx(np.pi**2 / 4, rel=2e-3)
    beyond = minimum(own.bodies, 2.6 * F)
    assert curvatures(own.bodies, beyond.state)[0] < 0


def test_first_frequency_of_a_heavy_cantilever():
    q, first = 5.0, []
    for parts in (4, 8):
        own = _cantilever(parts, q)
        own.lump()
        first.append(frequencies(own.bodies, own.bodies.at_rest())[0])
    exact = 1.8751041**2 * np.sqrt(EI / (q * L**4)) / (2 * np.pi)
    assert (4 * first[1] - first[0]) / 3 == pytest.approx(exact, rel=1e-3)


def test_a_hinge_leaves_one_turn():
    bodies = Bodies([np.zeros(3), np.array([0.5, 0, 0])], 1.0)
    bodies.joints = [SingleJoint(0, 1, np.array([0, 0, 1.0]), np.zeros(3), 0.0, (0.0, 50.0))]
    own = minimum(bodies, np.array([0, 10.0, 0, 0, 0, 0]))
    (angle,) = own.displacement[5:]
    assert 100 * angle == pytest.approx(10 * 0.5 * np.cos(angle), rel=1e-10)
    turned = [0.5 * (np.cos(angle) - 1), 0.5 * np.sin(angle), 0]
    assert own.displacement[:3] == pytest.approx(turned, abs=1e-12)
