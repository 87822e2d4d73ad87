"""Masses, densities and gravity as written in a model file."""

import numpy as np

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import find_posture, with_masses
from robostiff.model import Robot
from tests.files import text_of

MODEL = text_of("arm-with-masses.yaml")
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
