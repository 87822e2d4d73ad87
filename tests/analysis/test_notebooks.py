"""What notebooks show of robots, results and derivations."""

import re

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import differentiate
from tests.markup.test_blocks import text_of
from tests.report.machines import shipped


@pytest.fixture(scope="module")
def singular():
    return rs.stiffness(shipped("gough-stewart-a"))


def test_stiffness_shows_its_matrix_its_units_and_its_free_motions(singular):
    html = singular._repr_html_()
    text = text_of(html.replace("<br>", ""))
    kept = [float(value) for value in re.findall('<data value="(.*?)">', html)]
    assert kept == singular.K.ravel().tolist()
    assert "[N/m, N/rad, N m/rad]" in text
    assert "rank 3 of 6" in text
    for motion in singular.free_motions:
        assert str(motion) in text


def test_deflection_shows_load_displacement_and_who_bends():
    bent = rs.deflection(shipped("hexapod"), wrench=[0, 0, 1000, 0, 0, 0])
    text = text_of(bent._repr_html_())
    assert "1000 N" in text
    assert f"{bent.parts[0].leg}/{bent.parts[0].part}" in text
    assert "more parts" in text


def test_answers_that_are_missing_show_why():
    robot = shipped("3-rrr")
    far = [2.0, 0.0, 0.0]
    assert "cannot reach" in text_of(rs.stiffness(robot, far)._repr_html_())
    assert "cannot reach" in text_of(rs.deflection(robot, far, [1, 0, 0])._repr_html_())


def test_a_batch_shows_how_many_have_a_matrix():
    found = rs.stiffness(shipped("3-rrr"), np.zeros((4, 3)))
    assert "4 poses" in text_of(found._repr_html_())


@pytest.mark.parametrize("name", [*rs.shipped_robots()])
def test_robots_show_their_legs(name):
    robot = shipped(name)
    text = text_of(robot._repr_html_())
    assert robot.title in text
    for leg in robot.legs:
        assert leg.name in text


def test_derivations_show_typeset_formulas():
    robot = rs.load("planar-link", symbols=("L",))
    assert isinstance(robot, rs.Robot)
    derivation = rs.derive(robot)
    assert "<math" in derivation._repr_html_()
    assert "<mi>L</mi>" in derivation._repr_html_()
    derivative = differentiate(derivation, derivation.symbols[0])
    assert "<mo>∂</mo>" in derivative._repr_html_()
