"""Columns, beams and springs with answers on paper, and loaded reference cases."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from robostiff.spatial import Space
from tests.cases.metric import distance
from tests.statics.robots_under_load import (
    beam_legs,
    case,
    column,
    joint,
    loaded,
    number,
    planar_chain,
    root,
    stewart,
)

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


@pytest.mark.parametrize("name", ["L1_stewartB_springs_force", "L2b_stewartB_home_compression"])
def test_struts_near_their_critical_load(name: str):
    data = case(name)
    robot, _, _, _ = stewart(data)
    answer = loaded(robot, wrench=data["load"])
    assert answer.status == 0
    assert answer.stable
    assert distance(answer.K, np.array(data["K"])) < 1e-11
    assert np.abs(answer.pose[:3] - data["equilibrium"]["p"]).max() < 1e-13
    pulls = [number(part.load) for part in answer.parts if part.part == "strut"]
    assert np.allclose(pulls, data["equilibrium"]["leg_tension"], rtol=1e-11)
    assert answer.K_sym is not answer.K
    assert np.allclose(answer.K, answer.K.T, atol=1e-9 * np.abs(answer.K).max())


def test_critical_load_of_compressed_struts_is_where_the_determinant_vanishes():
    """From home straight down the platform sinks without turning: K of struts in closed form."""
    data = case("L2b_stewartB_home_compression")
    robot, base, arms, k = stewart(data)
    p0 = robot.reference_point
    F = data["load"][2]

    def at(z: float) -> tuple[float, np.ndarray]:
        force, K = 0.0, np.zeros((6, 6))
        for a, b in zip(base, arms, strict=True):
            e, e0 = np.array([*p0[:2], z]) + b - a, p0 + b - a
            length = np.linalg.norm(e)
            u, t = e / length, k * (length - np.linalg.norm(e0))
            G = k * np.outer(u, u) + t / length * (np.eye(3) - np.outer(u, u))
            B = np.array([[0, -b[2], b[1]], [b[2], 0, -b[0]], [-b[1], b[0], 0]])
            T = np.array(
                [[0, -t * u[2], t * u[1]], [t * u[2], 0, -t * u[0]], [-t * u[1], t * u[0], 0]]
            )
            J = np.hstack([np.eye(3), -B])
            K += J.T @ G @ J
            K[3:, 3:] += 0.5 * (B @ T + T @ B)
            force += t * u[2]
        return force, K

    def least(z: float) -> float:
        return float(np.linalg.eigvalsh(at(z)[1])[0])

    found = rs.critical_load(robot, wrench=data["load"])
    zs = np.linspace(p0[2], 0.7 * p0[2], 60)
    values = np.array([least(own) for own in zs])
    first = int(np.argmax(values < 0))
    z = root(least, float(zs[first - 1]), float(zs[first]))
    assert np.isclose(at(z)[0] / F, found.factor, rtol=1e-7)
    assert found.leg is None
    assert not found.is_limit
    assert "buckles" in found.mode


@pytest.mark.parametrize(("elements", "bound"), [(1, 1e-2), (2, 1e-3)])
def test_beam_column_against_stability_functions(elements: int, bound: float):
    data = case("L3_beamcolumn_0.3")
    s, L, load = data["section"], data["length"], data["load"]
    C = cantilever_compliance(L, *(s[name] for name in ("E", "G", "A", "Iy", "Iz", "J")))
    tip = np.array([L / (1 + load[0] / (s["E"] * s["A"])), 0, 0])  # L is the loaded length
    spring = PlacedSpring("beam", tip, np.eye(3), Elasticity(C))
    robot = Snapshot("column", (PlacedLeg("leg", (spring,), tip),), tip)
    answer = loaded(robot, wrench=load, beams=rs.Bowing(elements))
    assert answer.status == 0
    for rows in ([1, 5], [2, 4]):
        cells = np.ix_(rows, rows)
        own, exact = np.linalg.inv(answer.K[cells]), np.linalg.inv(np.array(data["K"])[cells])
        assert np.abs(own / exact - 1).max() < bound
    linear = loaded(robot, wrench=load, beams=rs.Linear())
    assert distance(linear.K, np.array(data["vjm_n_segments"]["1"]["K"])) < 1e-3
    assert abs(linear.K[2, 2] / data["K"][2][2] - 1) > 0.05


def test_compressed_planar_chain():
    data = case("L4_planar_RPRPR_compressed")
    chain = data["chain"]
    robot = planar_chain(
        chain["link1_axial_spring"], chain["elbow_spring"], chain["link2_axial_spring"]
    )
    moved = np.subtract(data["loaded_tip"], data["unloaded_tip"])
    answer = loaded(robot, displacement=[*moved, 0])
    assert answer.stable
    assert np.allclose(answer.wrench, data["F"], rtol=1e-11, atol=1e-9)
    assert np.abs(answer.K - np.array(data["K"])).max() < 1e-11 * np.abs(data["K"]).max()
    motion = {part.part: float(part.motion[0]) for part in answer.parts}
    assert np.isclose(motion["slide1"], data["equilibrium"]["s1"], rtol=1e-11)
    assert np.isclose(motion["elbow"], data["equilibrium"]["theta_elbow_deflection"], rtol=1e-11)


def test_platform_with_beam_legs():
    data = case("LP1_gough_stewart_b_beams")
    robot = beam_legs(data)
    answer = loaded(robot, wrench=data["wrench"], beams=rs.Linear())
    assert answer.stable
    assert distance(answer.K, np.array(data["K"])) < 1e-11
    assert np.abs(answer.pose - [*data["p"], *data["rotvec"]]).max() < 1e-14
    wrenches = np.array(data["leg_wrenches"])
    assert np.abs(np.array(answer.leg_wrenches) - wrenches).max() < 1e-12 * np.abs(wrenches).max()
    assert np.isclose(answer.energy, data["energy_and_node_work"], rtol=1e-12)
    # under a moment M its antisymmetric part is -skew(M)/2
    M = data["wrench"][3:]
    skew = np.array([[0, -M[2], M[1]], [M[2], 0, -M[0]], [-M[1], M[0], 0]])
    expected = np.zeros((6, 6))
    expected[3:, 3:] = -0.5 * skew
    assert np.abs((answer.K - answer.K.T) / 2 - expected).max() < 1e-6


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
