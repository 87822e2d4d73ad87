"""Springs between bodies and force laws of drives in model files."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.kinematics import find_posture, with_body_springs
from robostiff.model import Robot
from tests.files import text_of
from tests.statics.robots_under_load import loaded, number

ARM = text_of("balanced-arm.yaml")


def built(text: str, parameters: dict[str, str] | None = None, **options: object) -> Robot:
    robot = model_from_document(parse_document(text), parameters, **options)  # type: ignore[arg-type]
    assert isinstance(robot, Robot)
    return robot


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
