"""Drives whose stiffness depends on their coordinate: ball screws, and the same as constants."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.model import Actuated, PlacedBlock, PlacedFreedom, PlacedLeg, Snapshot, StiffnessLaw
from robostiff.robots import robot_file
from tests.statics.robots_under_load import loaded, number, root

ROOT = Path(__file__).parents[2]
SCREW = "1/(1/k + (q - 0.4 m)*(1.4 m - q)/(1 m*60 MN)), limits: [0.5 m, 1.3 m]"
ROBOTS = {
    "3-puu": SCREW,
    "orthoglide": "1/(1/k + (0.5 m + q)*(0.5 m - q)/(1 m*60 MN)), limits: [-450 mm, 450 mm]",
    "delta": "k*(1 + 0.3*(q/(1 rad))^2 - 0.2*q/(1 rad)), limits: [-1 rad, 1 rad]",
}


@pytest.fixture(scope="module")
def screws(tmp_path_factory: pytest.TempPathFactory) -> dict[str, rs.Robot]:
    """Shipped robots with such drives."""
    folder, found = tmp_path_factory.mktemp("screws"), {}
    for name, law in ROBOTS.items():
        text = robot_file(name).read_text()
        k, limits = law.split(", limits: ")
        file = folder / f"{name}.yaml"
        file.write_text(text.replace("stiffness: k}", f'stiffness: "{k}", limits: {limits}}}'))
        found[name] = rs.load(str(file))
    return found


def poses_of(robot: rs.Robot) -> np.ndarray:
    home = rs.find_posture(robot).pose[0, :3]
    return home + np.array([[0, 0, 0], [0.03, -0.02, 0.04], [-0.04, 0.03, -0.03]])


def with_constants(snapshot: Snapshot) -> Snapshot:
    """The same, each drive with the stiffness that it has there."""

    def of(leg: PlacedLeg) -> PlacedLeg:
        return replace(leg, elements=tuple(map(part, leg.elements)))

    def part(e):
        if isinstance(e, PlacedBlock):
            return replace(e, branches=tuple(map(of, e.branches)))
        if isinstance(e, PlacedFreedom) and e.coordinate is not None:
            return replace(e, role=Actuated(float(e.stiffness)), coordinate=None)
        return e

    return replace(snapshot, legs=tuple(map(of, snapshot.legs)))


@pytest.mark.parametrize("name", ROBOTS)
def test_everything_linear_has_k_at_the_pose(screws: dict[str, rs.Robot], name: str):
    """In closed form, in a batch, in a kernel and under no load; k as computed by hand."""
    robot = screws[name]
    poses = poses_of(robot)
    together, posture = rs.stiffness(robot, poses), rs.find_posture(robot, poses)
    kernel = rs.compile(robot, [rs.StiffnessMatrix()]).evaluate(poses)
    assert not kernel.guarded.any()
    (compiled,) = kernel.values.values()
    for i, pose in enumerate(poses):
        K = rs.stiffness(with_constants(posture.snapshot.one(i))).K
        close = {"rtol": 0, "atol": 1e-12 * np.abs(K).max()}
        assert np.allclose(together.K[i], K, **close)
        assert np.allclose(compiled[i], K, **close)
        assert np.allclose(loaded(robot, pose=pose).K, K, **close)
    if name == "3-puu":
        q = posture.coordinates[0][:, 0]
        leg = posture.snapshot.legs[0]
        k = 1 / (1 / 2e7 + (q - 0.4) * (1.4 - q) / 60e6)
        assert np.allclose(next(leg.freedoms).stiffness, k, rtol=1e-13)
        assert np.ptp(k) > 1e-4 * k[0]


def test_ball_screws_by_hand():
    """Two halves of a screw in parallel, in series with its bearings and the carriages."""
    table = rs.load(str(ROOT / "examples/ball-screws.yaml"))
    EA, L = 206e9 * np.pi * 0.03**2 / 4, 1.2
    for x in (-0.5, 0.0, 0.45):
        screw = EA / (0.6 + x) + EA / (0.6 - x)
        K = rs.stiffness(table, rs.JointCoordinates([x, 0.0])).K
        assert np.isclose(K[0, 0], 1 / (1 / screw + 1 / 2e8 + 1 / 4e8), rtol=1e-12)
    beyond = rs.stiffness(table, rs.JointCoordinates([0.55, 0.0]))
    assert rs.Status.BEYOND_LIMITS in beyond.status
    formula = rs.derive(str(ROOT / "examples/ball-screws.yaml"))
    known = {"EA": EA, "L": L, "kb": 2e8}
    value = formula.K[0, 0].subs({symbol: known[symbol.name] for symbol in formula.symbols})
    K = rs.stiffness(table, rs.JointCoordinates([0.0, 0.0])).K
    assert np.isclose(float(value), K[0, 0], rtol=1e-12)


def test_under_load_force_and_stiffness_derive_from_the_energy():
    """``U = k(x0 + q) q^2 / 2``: a screw alone, by hand."""
    x = sp.Symbol("x")
    k = 1 / (1 / sp.Float(2e6) + (x + 0.4) * (0.4 - x) / sp.Float(1e6))
    law = StiffnessLaw.of(k, x)
    x0, F = 0.1, 2e5
    own = law.from_rest(x0)
    U = sp.lambdify(x, k.subs(x, x0 + x) * x**2 / 2)
    force = sp.lambdify(x, sp.diff(k.subs(x, x0 + x) * x**2 / 2, x))
    tangent = sp.lambdify(x, sp.diff(k.subs(x, x0 + x) * x**2 / 2, x, 2))
    for q in (-0.2, 0.0, 0.13):
        got = (own.energy(q), own.at(q), own.tangent(q))
        assert np.allclose(got, (U(q), force(q), tangent(q)), rtol=1e-12)
    axes = ([1, 0, 0], [0, 1, 0], [0, 0, 1])
    tip = np.zeros(3)
    drive = Actuated(law, (-0.3, 0.3))
    others = [
        PlacedFreedom(np.array(a, float), tip, pitch, f"{i}{pitch}", Actuated(1e9))
        for pitch in (None, 0.0)
        for i, a in enumerate(axes)
        if (pitch, i) != (None, 0)
    ]
    first = PlacedFreedom(np.array([1.0, 0, 0]), tip, None, "screw", drive, x0)
    robot = Snapshot("screw", (PlacedLeg("leg", (first, *others), tip),), tip)
    q = root(lambda q: force(q) - F, 0, 0.2)
    answer = loaded(robot, wrench=[F, 0, 0, 0, 0, 0])
    assert np.isclose(answer.displacement[0], q, rtol=1e-11)
    assert np.isclose(answer.K[0, 0], tangent(q), rtol=1e-10)
    assert np.isclose(answer.energy, U(q), rtol=1e-10)
    assert np.isclose(number(answer.parts[0].load), F, rtol=1e-10)


@pytest.mark.parametrize("name", ["d", "r"])
def test_powers_of_parameters_are_numbers_in_a_formula_of_the_coordinate(name: str, tmp_path: Path):
    """Parameters are floats there, of which no power was taken: an `AttributeError`."""
    file = tmp_path / "screw.yaml"
    file.write_text(f"""
robostiff: 1
name: screw
source: chosen here
parameters: {{d: 30 mm, r: d/2 + 0 mm, n: r/r + d/d}}
legs:
  - name: leg
    chain:
      - type: prismatic
        axis: x
        role: actuated
        stiffness: 206 GPa*pi*{name}^2/(4*(q + 1 m)) * (1 + n^3)^0.5 * (q/(1 m) + 1)^n
        limits: [-0.5 m, 0.5 m]
      - {{type: spring, stiffness: [1e12, 1e12, 1e12, 1e12, 1e12, 1e12]}}
""")
    k = 206e9 * np.pi * {"d": 0.03, "r": 0.015}[name] ** 2 / (4 * 1.2) * 3 * 1.44
    K = rs.stiffness(rs.load(file), rs.JointCoordinates([0.2])).K
    assert K[0, 0] == pytest.approx(1 / (1 / k + 1e-12), rel=1e-12)
