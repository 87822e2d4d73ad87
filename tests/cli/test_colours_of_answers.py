"""What a person reads on a terminal: the same lines as elsewhere, some of them in colours."""

import re

import click
from click.testing import CliRunner

from robostiff.cli.main import app


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
