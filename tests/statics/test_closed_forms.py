"""Columns, pendulums and beams with answers on paper."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.model import PlacedLeg, Snapshot
from robostiff.spatial import Space
from tests.statics.robots_under_load import column, joint, loaded, number, root

STIFF = 1e8


def test_hinged_column_buckles_at_twice_k_by_its_length():
    """Links of length L that shorten by P/s: P (L - P/s) = 2 k."""
    k, s, L = 40.0, 1e6, 0.3
    found = rs.critical_load(column(k, s, L, STIFF), wrench=[0, -1, 0])
    exact = root(lambda P: P * (L - P / s) - 2 * k, 0, 1000)
    assert np.isclose(found.factor, exact, rtol=1e-7)
    assert np.isclose(exact, 2 * k / L, rtol=1e-2)
    assert found.leg == "links"
    assert "knee" in found.mode


def test_column_under_more_than_its_critical_load_says_so():
    k, L = 40.0, 0.3
    robot = column(k, 1e6, L, STIFF)
    below = loaded(robot, wrench=[0, -0.9 * 2 * k / L, 0])
    assert below.status == rs.Status.OK
    assert np.isclose(below.margin, 0.1, atol=2e-3)
    above = loaded(robot, wrench=[0, -1.2 * 2 * k / L, 0])
    assert not above.stable
    assert str(above.status) == "unstable+beyond-critical-load"
    assert np.isclose(number(above.critical_factor), 1 / 1.2, rtol=2e-3)
    assert "buckles" in above.advice[0]


@pytest.mark.parametrize("a", [0.05, 0.4, 1.0, 1.4])
def test_bent_column_carries_its_load(a: float):
    """Links at angles a and -a to the line of load: P = 2 k a / (L sin a), energy 2 k a^2."""
    k, L, z = 40.0, 0.3, [0, 0, 1]
    u, w = np.array([np.sin(a), np.cos(a), 0]), np.array([-np.sin(a), np.cos(a), 0])
    tip = np.array([0, 2 * L * np.cos(a), 0])
    links = (
        joint("base", [0, 0, 0], z),
        joint("link1", [0, 0, 0], u, "P", 1e11),
        joint("knee", L * u, z, "R", k),
        joint("link2", L * u, w, "P", 1e11),
        joint("end", tip, z),
    )
    bent = Snapshot("bent", (PlacedLeg("links", links, tip),), tip, Space.PLANAR)
    answer = loaded(bent, displacement=[0, 0, 0], preload={"links/knee": -2 * k * a})
    assert answer.stable
    assert np.isclose(-answer.wrench[1], 2 * k * a / (L * np.sin(a)), rtol=1e-7)
    assert np.allclose(answer.wrench[[0, 2]], 0, atol=1e-8)


@pytest.mark.parametrize("part", [0.5, 1.2])
def test_column_bent_by_its_knee_on_its_way(part: float):
    """A moment m in the knee: (2 k a - m) = P L sin a, from small loads to far beyond 2 k/L."""
    k, L, m = 40.0, 0.3, 0.5
    P = part * 2 * k / L
    answer = loaded(column(k, 1e7, L, 1e7), wrench=[0, -P, 0], preload={"links/knee": m})
    assert answer.status == rs.Status.OK
    a = root(lambda a: 2 * k * a - m - P * L * np.sin(a), 1e-6, np.pi)
    knee = next(part for part in answer.parts if part.part == "knee")
    assert np.isclose(knee.motion[0], 2 * a, rtol=2e-3)
    assert np.isclose(knee.energy, 2 * k * a * a, rtol=4e-3)
    shortened = 2 * P / 1e7
    assert np.isclose(answer.displacement[1], -2 * L * (1 - np.cos(a)) - shortened, rtol=1e-2)


def three_links(k: float, L: float, stretch: float) -> Snapshot:
    """Pashkevich's chain: three links of length L with springs k between, its end slides in y."""
    z, y = [0, 0, 1], [0, 1, 0]
    tip = np.array([0, 3 * L, 0])
    links = (
        joint("base", [0, 0, 0], z),
        joint("link1", [0, 0, 0], y, "P", stretch),
        joint("elbow1", [0, L, 0], z, "R", k),
        joint("elbow2", [0, 2 * L, 0], z, "R", k),
        joint("link3", [0, 2 * L, 0], y, "P", stretch),
        joint("end", tip, z),
    )
    rail = (
        joint("rail", tip, y, "P"),
        joint("across", tip, [1, 0, 0], "P", stretch),
        joint("turn", tip, z, "R", stretch),
    )
    legs = (PlacedLeg("links", links, tip), PlacedLeg("guide", rail, tip))
    return Snapshot("three links", legs, tip, Space.PLANAR)


def test_three_links_buckle_in_a_u_at_k_by_their_length():
    """The U at k/L comes before the Z at 3 k/L."""
    k, L = 40.0, 0.3
    found = rs.critical_load(three_links(k, L, 1e8), wrench=[0, -1, 0])
    assert np.isclose(found.factor, k / L, rtol=1e-5)
    assert found.leg == "links"
    assert "elbow" in found.mode
