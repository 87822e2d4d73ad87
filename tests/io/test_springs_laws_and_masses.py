"""Springs between bodies, laws of force, masses and gravity in files."""

import json
from dataclasses import fields

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.io.snapshot import (
    network_from_document,
    network_to_data,
    snapshot_from_document,
    snapshot_to_data,
)
from robostiff.kinematics import find_posture, with_body_springs, with_masses
from robostiff.model import Robot
from robostiff.network import network_of_snapshot
from tests.cli.running import Running
from tests.files import text_of, written
from tests.statics.robots_under_load import loaded, number

ONE = rs.Bowing(elements=1)


def heavy(name: str) -> rs.Snapshot:
    """A shipped robot with a spindle on its platform, at home."""
    robot = rs.load(name)
    spindle = rs.Mass(15, [0.01, 0.02, 0.05], name="spindle", inertia=[0.4, 0.5, 0.7])
    robot = rs.Robot(**{**vars_of(robot), "platform_masses": (spindle,), "gravity": "-z"})
    return with_masses(rs.find_posture(robot)).one(0)


def vars_of(robot: rs.Robot) -> dict:
    return {own.name: getattr(robot, own.name) for own in fields(robot)}


@pytest.mark.parametrize("name", ["six-joint-arm", "3-puu", "orthoglide"])
def test_masses_and_gravity_are_read_back(name: str):
    snapshot = heavy(name)
    network = network_of_snapshot(snapshot)
    legs = snapshot_from_document(parse_document(json.dumps(snapshot_to_data(snapshot))))
    graph = network_from_document(parse_document(json.dumps(network_to_data(network))))
    F = [20, -10, -30, 1, 2, 3.0]
    for one, other in ((snapshot, legs), (network, graph)):
        a, b = rs.modes(one, beams=ONE), rs.modes(other, beams=ONE)
        assert len(a) == len(b) > 5
        assert np.allclose(b.frequencies[:9], a.frequencies[:9], rtol=1e-7)
        a, b = (rs.equilibrium(own, wrench=F, beams=ONE) for own in (one, other))
        assert np.allclose(b.displacement, a.displacement, rtol=1e-8, atol=1e-14)
    assert legs.gravity is not None
    assert np.allclose(legs.gravity, [0, 0, -9.80665])
    weight = sum(float(own.value) for leg in snapshot.legs for own in leg.masses)
    assert np.isclose(weight, sum(float(own.value) for leg in legs.legs for own in leg.masses))


def crane(**more: object) -> dict:
    rod = {
        "type": "beam",
        "name": "rod",
        "start": [0, 0, 0],
        "end": [1.2, 0, 0],
        "y_axis": [0, 1, 0],
        "E": 2e11,
        "G": 8e10,
        "A": 1e-3,
        "Iy": 1e-7,
        "Iz": 1e-7,
        "J": 2e-7,
        "density": 7850,
    }
    leg = {"name": "boom", "end": [1.2, 0, 0], "chain": [rod], **more}
    return {"name": "crane", "reference_point": [1.2, 0, 0], "legs": [leg]}


def read(data: dict) -> rs.Snapshot:
    return snapshot_from_document(parse_document(json.dumps(data)))


def test_a_beam_with_a_density_and_masses_along_it():
    """q L^4 / 8 E I, a mass at its end, one in its middle, and half of a beam that is covered."""
    g, L, EI, q = 9.80665, 1.2, 2e4, 7.85
    sunk = [q * L**4 / 8, 3.0 * L**3 / 3, 2.0 * 5 * L**3 / 48, 4.0 / L * 2 * 41 * L**4 / 384]
    given = [
        [],
        [{"mass": 3, "after": "rod"}],
        [{"mass": 2, "after": "rod", "start": [0, 0, 0], "at": [0.6, 0, 0]}],
        [{"mass": 4, "after": "rod", "start": [0, 0, 0], "span": [0.5, 1]}],
    ]
    for own, more in zip(sunk, given, strict=True):
        bent = rs.deflection(read(crane(masses=more)), gravity="-z")
        expected = (sunk[0] + (own if more else 0.0)) * g / EI
        assert np.isclose(-bent.twist[2], expected, rtol=1e-9)


def test_the_same_as_a_graph(tmp_path):
    rod = {key: own for key, own in crane()["legs"][0]["chain"][0].items() if key != "type"}
    graph = {
        "nodes": {"wall": [0, 0, 0], "tip": [1.2, 0, 0]},
        "fixed": ["wall"],
        "platform": "tip",
        "beams": [{**rod, "a": "wall", "b": "tip"}],
        "masses": [{"on": "tip", "mass": 3, "at": [1.2, 0, 0.1], "inertia": [0.1, 0.2, 0.25]}],
    }
    data = {
        "name": "crane",
        "reference_point": [1.2, 0, 0],
        "gravity": [0, 0, -9.8],
        "graph": graph,
    }
    network = network_from_document(parse_document(json.dumps(data)))
    mass = {**graph["masses"][0], "after": "rod"}
    del mass["on"]
    legs = read({**crane(masses=[mass]), "gravity": [0, 0, -9.8]})
    assert np.allclose(rs.modes(network).frequencies, rs.modes(legs).frequencies, rtol=1e-9)
    found = Running().answer("modes", str(written(tmp_path / "crane.json", json.dumps(data))))
    told = [mode["frequency"] for mode in found["modes"]]
    assert np.allclose(told, rs.modes(legs).frequencies, rtol=1e-9)


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


ARM = text_of("balanced-arm.yaml")


def built(text: str, parameters: dict[str, str] | None = None, **options: object) -> Robot:
    return model_from_document(parse_document(text), parameters, **options)  # type: ignore[arg-type]


def shoulder(robot: Robot, degrees: float = 20.0, **options: object) -> rs.Equilibrium:
    return loaded(robot, pose=rs.JointCoordinates([np.radians(degrees)]), **options)


@pytest.mark.parametrize("degrees", [20.0, -35.0, 80.0])
def test_compensator_of_a_file_balances_moments(degrees: float):
    """At every pose: drive, weights and spring about the shoulder, on paper."""
    answer = shoulder(built(ARM), degrees)
    part = next(part for part in answer.parts if part.part == "shoulder")
    angle = np.radians(degrees) + float(part.motion[0])
    end = 0.3 * np.array([np.cos(angle), np.sin(angle)])
    d = np.array([0, 0.3]) - end
    length = float(np.linalg.norm(d))
    pull = 1200.0 * (length - 0.1) * d / length
    weights = 9.80665 * (3 * 0.4 + 12 * 0.8) * np.cos(angle)
    moment = end[0] * pull[1] - end[1] * pull[0] - weights
    assert np.isclose(number(part.load), moment, rtol=1e-5)
    (spring,) = answer.springs
    assert np.isclose(spring.length, length, rtol=1e-6)
    assert np.isclose(spring.tension, 1200.0 * (length - 0.1), rtol=1e-6)


def test_preload_is_the_tension_at_home():
    text = ARM.replace("free_length: 100 mm", "preload: 250 N")
    (home,) = with_body_springs(find_posture(built(text))).one(0).springs
    assert home.tension == 250.0
    assert np.isclose(home.length, np.linalg.norm(home.points[1] - home.points[0]))
    away = shoulder(built(text), 60.0, gravity=[0, 0, 0])
    (spring,) = away.springs
    assert np.isclose(spring.tension, 250 + 1200 * (spring.length - home.length), rtol=1e-9)


def test_parameters_of_a_spring_may_be_symbols():
    robot = built(ARM, symbols=("k",))
    assert str(robot.springs[0].stiffness) == "k"
    (spring,) = shoulder(robot.numeric).springs
    (same,) = shoulder(built(ARM)).springs
    assert np.isclose(spring.tension, same.tension, rtol=1e-12)


LAWS = ARM + 'laws: {"*/shoulder": drive*q + 4e4 N m*q^3}\n'


def test_law_of_a_file_acts_under_load():
    """k q + c q^3 = m g l cos(angle) less the moment of the spring, which is left out here."""
    robot = built(LAWS).with_springs()
    answer = shoulder(robot)
    part = next(part for part in answer.parts if part.part == "shoulder")
    q = float(part.motion[0])
    weights = 9.80665 * (3 * 0.4 + 12 * 0.8) * np.cos(np.radians(20) + q)
    assert abs(q) > 0.01
    assert np.isclose(5e3 * q + 4e4 * q**3, -weights, rtol=1e-5)
    plain = shoulder(built(ARM).with_springs()).parts[0].motion[0]
    assert abs(plain - q) > 1e-5
    # a law that is given takes its place, and small loads meet the stiffness without motion
    linear = {"arm/shoulder": rs.ForceLaw([[-1, -5e3], [0, 0], [1, 5e3]])}
    assert np.isclose(shoulder(robot, laws=linear).parts[0].motion[0], plain, rtol=1e-9)
    assert np.allclose(rs.stiffness(robot).K, rs.stiffness(built(ARM).with_springs()).K)


def test_table_and_expression_of_one_law_are_one():
    rows = ", ".join(f"[{q} rad, {5e3 * q} N m]" for q in (-1, 0, 1))
    table = built(ARM + f"laws: {{arm/shoulder: [{rows}]}}\n")
    plain, tabled = shoulder(built(ARM)), shoulder(table)
    assert np.allclose(plain.displacement, tabled.displacement, rtol=1e-9, atol=1e-15)
