"""Cable robots in model files, by name, and on the command line."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import robostiff as rs
from robostiff.cli.main import app
from robostiff.io.document import parse_document
from robostiff.io.model_file import model_from_document
from robostiff.robots import describe, robot_file
from tests.cables.machines import cable_robot
from tests.project.shown_output import ROOT

STATUS = rs.Status

HEAD = """
robostiff: 1
name: test
source: a test
home: {at: [0, 0, -1 m]}
"""
ROPE = "{name: a, exit: [0, 0, 0], platform: [0, 0, 0], EA: 10 kN}"


def built(text: str) -> rs.CableRobot:
    return model_from_document(parse_document(HEAD + text, "test.yaml"))


def ran(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    return result.exit_code, result.output


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


@pytest.mark.parametrize("name", rs.shipped_cable_robots())
def test_shipped_file(name):
    robot, info = cable_robot(name), describe(name)
    assert (robot.name, robot.title, robot.source) == (name, info.title, info.source)
    assert len(info.title) < 90
    assert all(len(line) <= 130 for line in robot_file(name).read_text().splitlines())


def test_parameters_of_a_shipped_robot():
    robot = rs.load("cable-8", {"EA": "50 kN"})
    assert isinstance(robot, rs.CableRobot)
    assert robot.cables[0].EA == 5e4


def test_stiffness_command():
    code, output = ran("stiffness", "cable-4-planar")
    assert code == 0
    assert "rank 3 of 3, 3 by stretching" in output
    code, output = ran("stiffness", "cable-8", "--pose", "0 0 3 0 0 0", "--json")
    data = json.loads(output)
    assert (code, data["status"], data["stiffness"]) == (1, "infeasible", None)


def test_cables_command_with_a_load():
    words = ("cables", "cable-8", "--wrench", "0 0 -200 N 0 0 0")
    code, output = ran(*words)
    assert code == 0
    assert "slack: cable5, cable6, cable7, cable8" in output
    assert "times the load" in output
    data = json.loads(ran(*words, "--json")[1])
    assert data["slack"] == ["cable5", "cable6", "cable7", "cable8"]
    assert data["first_slack"]["factor"] == pytest.approx(0.77, abs=0.01)


def test_cables_command_with_rules():
    given = ("--tensions", " ".join(["60 N"] * 8))
    code, output = ran("cables", "cable-8", *given)
    assert code == 1
    assert "unbalanced" in output
    code, output = ran("cables", "cable-8", "--rule", "closed-form", "--balance", "0 0 90 N 0 0 0")
    assert code == 0
    assert "tensions: closed-form" in output
    assert "balanced: Fz 90 N" in output


def test_robots_and_check_know_cable_robots():
    assert "cable-8-suspended" in ran("robots")[1]
    assert "cables: cable1, cable2" in ran("check", "cable-4-planar")[1]


OF_OTHERS = STATUS.REDUNDANT_JOINTS | STATUS.RIGID_DIRECTION | STATUS.BEYOND_CRITICAL_LOAD


@pytest.mark.parametrize("status", [STATUS.OK, *(s for s in STATUS if not s & OF_OTHERS)], ids=str)
def test_every_status_is_on_the_page_and_has_advice(status):
    page = (ROOT / "docs/cables.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{status.name}` |"))
    bad, meaning = (cell.strip() for cell in row.split("|")[2:4])
    assert bad == ("yes" if status.is_bad else "no")
    assert ("no matrix" in meaning) == (not status.has_stiffness)
    assert len(status.advice) == (status != STATUS.OK)
