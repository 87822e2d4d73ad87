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


def pendulum() -> Snapshot:
    """A rigid rod of length 0.5 on a hinge, horizontal, its end the platform."""
    tip = np.array([0.5, 0, 0])
    elements = (
        joint("hinge", [0, 0, 0], [0, 0, 1]),
        joint("rod", [0, 0, 0], [1, 0, 0], "P", 1e9),
        joint("end", tip, [0, 0, 1], "R", 1e9),
    )
    return Snapshot("pendulum", (PlacedLeg("rod", elements, tip),), tip, Space.PLANAR)


def test_pendulum_hangs_below_its_hinge():
    answer = loaded(pendulum(), wrench=[0, -20, 0])
    assert answer.stable
    assert np.allclose(answer.point, [0, -0.5, 0], atol=1e-7)
    assert np.isclose(1 / np.linalg.inv(answer.K_total)[0, 0], 20 / 0.5, rtol=1e-6)


def test_weight_of_a_rod_bends_its_spring():
    """A rod on a hinge with spring k, weight f at c from the hinge: k q = f c cos q."""
    k, f, c = 30.0, 45.0, 0.4
    tip = np.array([0.5, 0, 0])
    elements = (
        joint("hinge", [0, 0, 0], [0, 0, 1], "R", k),
        joint("rod", [0, 0, 0], [1, 0, 0], "P", 1e9),
        joint("end", tip, [0, 0, 1], "R", 1e9),
    )
    robot = Snapshot("rod", (PlacedLeg("arm", elements, tip),), tip, Space.PLANAR)
    q = root(lambda q: k * q + f * c * np.cos(q), -2, 0)
    for loads in (
        {"arm/hinge": rs.DeadForce([0, -f, 0], [c, 0, 0])},
        {"platform": rs.DeadForce([0, -f, 0], [c, 0, 0])},
    ):
        answer = loaded(robot, loads=loads)
        assert answer.stable
        hinge = answer.parts[0]
        assert np.isclose(hinge.motion[0], q, rtol=2e-7)
        assert np.isclose(number(hinge.load), k * q, rtol=2e-7)
        assert np.isclose(hinge.wrench[5], k * q, rtol=2e-7)
        assert np.isclose(answer.potential, k * q * q / 2 + f * c * np.sin(q), rtol=1e-6)


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


@pytest.mark.parametrize("part", [0.6, 1.3])
def test_three_links_bent_to_a_u(part: float):
    """Moments m in both springs: outer links at a and -a carry P = (k a - m) / (L sin a)."""
    k, L, m = 40.0, 0.3, 0.5
    P = part * k / L
    preload = {"links/elbow1": m, "links/elbow2": m}
    answer = loaded(three_links(k, L, 1e7), wrench=[0, -P, 0], preload=preload)
    assert answer.status == rs.Status.OK
    a = root(lambda a: k * a - m - P * L * np.sin(a), 1e-6, np.pi)
    elbows = [part for part in answer.parts if part.part.startswith("elbow")]
    for elbow in elbows:
        assert np.isclose(elbow.motion[0], a, rtol=3e-3)
    assert np.isclose(answer.displacement[1], -2 * L * (1 - np.cos(a)), atol=1e-4)
