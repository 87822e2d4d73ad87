"""Exported C, compiled, and exported Python, run, of whole robots against the numerical form."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import c_function, python_function
from robostiff.analytic.export.program import program
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from tests.analytic.export.test_c_code import called, compiled
from tests.analytic.export.test_julia_and_matlab import POSED, largest_difference

QUICK = ("3-rrr", "orthoglide", "six-joint-arm")


@pytest.mark.needs("a C compiler")
@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in POSED]
)
def test_programs_give_the_stiffness_of_a_robot(name, tmp_path):
    robot, pose = rs.load(name, symbols=rs.ALL_PARAMETERS), POSED[name]
    derivation = rs.derive(robot, pose=pose)
    space = {}
    exec(python_function(derivation), space)  # noqa: S102
    in_c = compiled(c_function(derivation), tmp_path)
    checked = 0
    for values, result, _ in closed_places(place_robot(robot, pose), sets=2, poses=2):
        given = [float(values[s.name]) for s in program(derivation).arguments]
        K = result.K
        assert largest_difference(called(in_c, given, len(K)), K) < 1e-12
        assert largest_difference(np.asarray(space["stiffness"](*given)), K) < 1e-12
        checked += 1
    assert checked


def test_a_program_takes_the_vectors_where_they_are_shorter():
    derivation = rs.derive("orthoglide", pose=rs.AtSymbols())
    steps = rs.derive("orthoglide", pose=rs.AtSymbols(), form=rs.Steps())
    assert program(derivation).operations < 0.6 * program(steps).operations
    assert program(derivation).arguments == program(steps).arguments
    assert "d_1_x" in python_function(derivation)
