"""Cable robots in model files, by name, and on the command line."""

import numpy as np

import robostiff as rs
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document

HEAD = """
robostiff: 1
name: test
source: a test
home: {at: [0, 0, -1 m]}
"""
ROPE = "{name: a, exit: [0, 0, 0], platform: [0, 0, 0], EA: 10 kN}"


def built(text: str) -> rs.CableRobot:
    return model_from_document(parse_document(HEAD + text, "test.yaml"))


def test_numbers_of_a_file():
    robot = built(
        "tensions: {least: 10 N, greatest: 1 kN, level: 0.5}\n"
        "weight: {force: [0, 0, -50 N], at: [0, 0, -100 mm]}\n"
        "reference_point: [0, 0, 20 mm]\n"
        "cables:\n"
        "  - {name: a, exit: [1 m, 0, 0], platform: [10 mm, 0, 0], EA: 10 kN, "
        "guide_length: 500 mm, winch_stiffness: 2e5 N/m, least_tension: 0 N}\n"
        "  - repeat: {count: 2, variable: i}\n"
        "    let: {phi: i*90 deg}\n"
        "    exit: [cos(phi), sin(phi), 0]\n"
        "    platform: [0, 0, 0]\n"
        "    EA: 20 kN\n"
    )
    a, b, c = robot.cables
    assert (a.EA, a.guide_length, a.winch_stiffness) == (1e4, 0.5, 2e5)
    assert robot.tension_limits[0].tolist() == [0, 10, 10]
    assert robot.tension_limits[1].tolist() == [1000, 1000, 1000]
    assert (b.name, c.name) == ("cable1", "cable2")
    np.testing.assert_allclose(c.exit_point, [-1, 0, 0], atol=1e-12)
    assert robot.tension_level == 0.5
    assert robot.weight is not None
    assert robot.weight.point.tolist() == [0, 0, -0.1]
    assert robot.reference_point.tolist() == [0, 0, 0.02]


def test_parameters_of_a_shipped_robot():
    robot = rs.load("cable-8", {"EA": "50 kN"})
    assert isinstance(robot, rs.CableRobot)
    assert robot.cables[0].EA == 5e4
