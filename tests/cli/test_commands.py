"""Every shipped robot by a command, and the command in a process of its own."""

import json
import re
import subprocess
import sys

import click
import numpy as np
import pytest
from click.testing import CliRunner

from robostiff.cli.main import app
from robostiff.markup import in_words, page_html
from robostiff.page import robots_page
from robostiff.robots import describe, shipped_cable_robots, shipped_linkages, shipped_robots
from tests.cli.running import Running

run = Running()
answer = run.answer


def test_json_of_stiffness_has_an_inverse_and_its_order():
    found = answer("stiffness", "gough-stewart-b")
    assert (found["status"], found["method"]) == ("ok", "wrench-basis")
    assert found["order"]["twist"] == ["dx", "dy", "dz", "rx", "ry", "rz"]
    inverse = np.array(found["stiffness"]) @ np.array(found["compliance"])
    np.testing.assert_allclose(inverse, np.eye(6), atol=1e-9)


@pytest.mark.parametrize("name", shipped_robots())
def test_every_shipped_robot_can_be_checked_and_asked(name):
    assert answer("check", name)["name"] == name
    text = run("stiffness", name)
    assert text.exit_code == 0
    assert "status: " in text.stdout


def test_robots_lists_names_and_sources():
    listed = json.loads(run("robots", "--json").stdout)["robots"]
    assert [robot["name"] for robot in listed] == sorted(
        (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    )
    assert all(robot["source"] for robot in listed)
    lines = run("robots").stdout.splitlines()
    assert lines[0] == f"{len(listed)} robots come with robostiff:"
    assert [line.split()[0] for line in lines[2:]] == [robot["name"] for robot in listed]
    html = page_html(robots_page([describe(robot["name"]) for robot in listed]))
    assert all(in_words(robot["source"]) in html for robot in listed)


def test_the_installed_command_runs_in_a_process_of_its_own():
    command = [sys.executable, "-m", "robostiff.cli.main", "stiffness", "gough-stewart-b"]
    outcome = subprocess.run(command, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0
    assert "rank 6 of 6" in outcome.stdout


def shown(*arguments: str, color: bool = True) -> str:
    return CliRunner().invoke(app, [*arguments], color=color).stdout


def test_status_and_advice_stand_out():
    text = shown("stiffness", "gough-stewart-a")
    assert click.style("status: free-motions", bold=True) in text
    assert click.style("advice: the platform can move", fg="yellow")[:-4] in text
    assert click.style("status: ok", fg="green") in shown("stiffness", "hexapod")


def test_lines_are_those_of_a_file_and_matrices_fit_eighty_columns():
    load = ("--wrench", "200 N 0 -500 0 10 0")
    there = ("stiffness", "3-puu", "--pose", "0.08 0.05 0.25")
    for words in (there, ("deflection", "hexapod", *load)):
        plain = shown(*words, color=False)
        assert click.unstyle(shown(*words)) == plain
        assert max(len(line) for line in plain.splitlines() if "  " in line) <= 80


def test_the_load_of_an_actuator_has_the_unit_of_its_coordinate():
    slides = shown("deflection", "hexapod", "--wrench", "0 0 -500 N 0 0 0", color=False)
    assert re.search(r"^leg1/strut +\S+ N  ", slides, re.MULTILINE)
    turns = shown("deflection", "six-joint-arm", "--wrench", "0 0 -50 N 0 0 0", color=False)
    assert re.search(r"^arm/joint2 +\S+ N m  ", turns, re.MULTILINE)
