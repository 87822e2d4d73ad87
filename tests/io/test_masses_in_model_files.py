"""Masses, densities and gravity as written in a model file."""

import numpy as np

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import find_posture, with_masses
from robostiff.model import Robot

MODEL = """
robostiff: 1
name: arm
source: for this test
parameters: {L: 500 mm, tool: 3 kg, rho: 7000 kg/m^3}
materials: {iron: {E: 170 GPa, poisson_ratio: 0.27, density: rho}}
sections: {bar: {circle: {diameter: 40 mm}}}
gravity: -z
platform_masses: [{name: tool, mass: tool, centre: [0, 0, 50 mm]}]
legs:
  - name: arm
    chain:
      - {type: revolute, axis: y, role: actuated, stiffness: 2e5 N m/rad}
      - {type: rigid, name: motor, to: [0, 0, 0], mass: 2*tool, centre: [0, 20 mm, 0]}
      - {type: rigid, name: bracket, to: [0, 0, 0.1], mass: 1 kg}
      - {type: beam, name: upper, to: [L, 0, 0], material: iron, section: bar}
      - type: beam
        name: taper
        to: [L, 0, 0]
        material: iron
        taper:
          - {share: 0.5, section: bar}
          - {share: 0.5, section: {circle: {diameter: 30 mm}}}
      - {type: spring, name: gear, stiffness: [1e8, 1e8, 1e8, 1e5, 1e5, 1e5], mass: 0.5 kg}
      - {type: beam, name: heavy, to: [L, 0, 0], material: iron, mass: 9 kg, section: bar}
      - type: telescope
        direction: x
        home: 0.2
        role: actuated
        stiffness: 1e7
        beams:
          - {share: 0.0, fixed: 0.1, mass: 0.7 kg, material: iron, section: bar}
          - {share: 1.0, fixed: 0.1, material: iron, section: bar}
"""
ROUND = np.pi * 0.04**2 / 4


def model(text: str = MODEL, **options: object) -> Robot:
    return model_from_document(parse_document(text), **options)  # type: ignore[arg-type]


def placed(robot: Robot) -> dict[str, list[tuple[float, list[float]]]]:
    found: dict[str, list[tuple[float, list[float]]]] = {}
    for mass in with_masses(find_posture(robot)).one(0).legs[0].masses:
        found.setdefault(mass.name, []).append((float(mass.value), mass.centre.tolist()))
    return found


def test_masses_and_where_they_are():
    robot = model()
    found = placed(robot)
    wanted = {
        "motor": [(6.0, [0, 0.02, 0])],
        "bracket": [(1.0, [0, 0, 0.05])],
        "upper": [(7000 * ROUND * 0.5, [0.25, 0, 0.1])],
        "taper": [
            (7000 * ROUND * 0.25, [0.625, 0, 0.1]),
            (7000 * ROUND * 0.25 * 0.75**2, [0.875, 0, 0.1]),
        ],
        "gear": [(0.5, [1, 0, 0.1])],
        "heavy": [(9.0, [1.25, 0, 0.1])],
        "telescope1.beam1": [(0.7, [1.55, 0, 0.1])],
        "telescope1.beam2": [(7000 * ROUND * 0.3, [1.75, 0, 0.1])],
    }
    assert found.keys() == wanted.keys()
    for name, own in wanted.items():
        for (value, centre), (mass, at) in zip(found[name], own, strict=True):
            assert np.isclose(value, mass, rtol=1e-12), name
            assert np.allclose(centre, at, atol=1e-12), name
    assert robot.gravity.tolist() == [0, 0, -9.80665]
    (tool,) = robot.platform_masses
    assert (tool.name, tool.value, tool.centre.tolist()) == ("tool", 3.0, [0, 0, 0.05])


def test_masses_follow_parameters_and_symbols():
    other = placed(model(parameters={"L": "400 mm", "rho": "8 g/cm^3"}))
    symbolic = model(symbols=("L", "tool", "rho"))
    exact = placed(symbolic.substituted({"L": 0.4, "tool": 3.0, "rho": 8000.0}))
    assert np.isclose(other["upper"][0][0], 8000 * ROUND * 0.4)
    for name, own in other.items():
        for (value, centre), (mass, at) in zip(own, exact[name], strict=True):
            assert np.isclose(value, mass, rtol=1e-12), name
            assert np.allclose(centre, at, atol=1e-12), name
    assert {"tool", "rho"} <= set(map(str, symbolic.symbols))


def test_masses_leave_the_stiffness_alone():
    bare = "\n".join(line for line in MODEL.splitlines() if "gravity" not in line)
    assert np.array_equal(rs.stiffness(model()).K, rs.stiffness(model(bare)).K)
