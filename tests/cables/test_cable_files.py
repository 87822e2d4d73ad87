"""Cable robots in model files, by name, and on the command line."""

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


def test_parameters_of_a_shipped_robot():
    robot = rs.load("cable-8", {"EA": "50 kN"})
    assert robot.cables[0].EA == 5e4
