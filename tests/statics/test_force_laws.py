"""Springs whose stiffness depends on their motion: on paper, and the same as linear ones."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.model import PlacedLeg, Snapshot
from robostiff.spatial import Space
from tests.statics.robots_under_load import column, joint, loaded, number, root

Q = sp.Symbol("q")
K1, K3 = 500.0, 2e6


def slider(k: float | None = 500.0) -> Snapshot:
    """A slide along x, and stiff guides across it."""
    tip = np.array([0.3, 0, 0])
    elements = (
        joint("spring", [0, 0, 0], [1, 0, 0], "P", k),
        joint("across", tip, [0, 1, 0], "P", 1e7),
        joint("turn", tip, [0, 0, 1], "R", 1e5),
    )
    return Snapshot("slider", (PlacedLeg("leg", elements, tip),), tip, Space.PLANAR)


@pytest.mark.parametrize("F", [3.0, 40.0, -200.0])
def test_hardening_spring(F: float):
    """``k1 x + k3 x^3 = F``; K is the tangent ``k1 + 3 k3 x^2``."""
    x = root(lambda x: K1 * x + K3 * x**3 - F, -1, 1)
    law = rs.ForceLaw(K1 * Q + K3 * Q**3)
    answer = loaded(slider(), wrench=[F, 0, 0], laws={"leg/spring": law})
    assert answer.status == 0
    assert np.isclose(answer.displacement[0], x, rtol=1e-12)
    assert np.isclose(answer.K[0, 0], K1 + 3 * K3 * x * x, rtol=1e-12)
    assert np.isclose(answer.energy, K1 * x * x / 2 + K3 * x**4 / 4, rtol=1e-12)
    assert np.isclose(number(answer.parts[0].load), F, rtol=1e-12)
    assert np.isclose(law.secant(x), F / x, rtol=1e-12)
    mode = rs.modes(slider(), masses={"platform": 2.0}, wrench=[F, 0, 0], laws={"leg/spring": law})
    exact = np.sqrt((K1 + 3 * K3 * x * x) / 2.0) / (2 * np.pi)
    assert np.isclose(mode.frequencies[0], exact, rtol=1e-10)


def test_a_table_goes_on_straight_and_stores_what_it_takes():
    law = rs.ForceLaw([[-0.02, -30], [-0.01, -5], [0, 0], [0.01, 5], [0.02, 30]])
    for F in (2.0, 12.0, 60.0):
        answer = loaded(slider(), wrench=[F, 0, 0], laws={"leg/spring": law})
        x = float(answer.displacement[0])
        assert np.isclose(law.at(x), F, rtol=1e-12)
        h = 1e-6
        assert np.isclose(law.tangent(x), (law.at(x + h) - law.at(x - h)) / (2 * h), rtol=1e-5)
        assert np.isclose(law.at(x), (law.energy(x + h) - law.energy(x - h)) / (2 * h), rtol=1e-6)
        assert np.isclose(answer.K[0, 0], law.tangent(x), rtol=1e-12)


def test_a_softening_knee_buckles_sooner():
    """At rest a knee ``k q - c q^3`` has k: 2 k/L as ever; but it snaps from there."""
    k, L = 40.0, 0.3
    law = rs.ForceLaw(k * Q - 30 * Q**3)
    found = rs.critical_load(
        column(10 * k, 1e8, L, 1e8), wrench=[0, -1, 0], laws={"links/knee": law}
    )
    assert np.isclose(found.factor, 2 * k / L, rtol=1e-4)


@pytest.mark.parametrize("motion", [0.0021, 0.5])
def test_energy_of_stops_and_friction(motion: float):
    """Laws with a kink, or of a scale far below the motion, integrated by hand."""
    k, stop, gap, force, slip = 2e5, 1e8, 1 / 3000, 1e3, 1e-6
    touching = rs.ForceLaw(k * Q + stop * sp.Max(0, Q - gap))
    stored = k * motion**2 / 2 + stop * (motion - gap) ** 2 / 2
    assert np.isclose(touching.energy(motion), stored, rtol=1e-12)
    assert np.isclose(touching.energy(-motion), k * motion**2 / 2, rtol=1e-12)
    sliding = rs.ForceLaw(force * sp.tanh(Q / slip))
    lost = force * (motion - slip * np.log(2))  # ln cosh z = z - ln 2 for large z
    assert np.isclose(sliding.energy(motion), lost, rtol=1e-12)
