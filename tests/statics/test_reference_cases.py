"""Loaded reference cases: Stewart platforms, a beam-column, a compressed chain, beam legs."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.elasticity import Elasticity, cantilever_compliance
from robostiff.model import PlacedLeg, PlacedSpring, Snapshot
from tests.cases.metric import distance
from tests.statics.robots_under_load import (
    beam_legs,
    case,
    loaded,
    number,
    planar_chain,
    root,
    stewart,
)


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
