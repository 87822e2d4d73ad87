"""Exported programs of whole robots against the numerical form."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import matlab_function, python_function
from robostiff.analytic.export.program import program
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from tests.analytic.export.programs import READERS, in_c, in_python, largest_difference
from tests.analytic.export.test_functions import octave

# Closed forms and steps, parameters and poses, legs by closed forms and by joint coordinates.
POSED = {
    "3-rps": rs.AtSymbols(),
    "3-rrr": rs.AtJoints(),
    "agile-eye": rs.AtHome(),
    "delta": rs.AtSymbols(),
    "gantry-tau": rs.AtSymbols(),
    "h4": rs.AtHome(),
    "hexaglide": rs.AtSymbols(),
    "orthoglide": rs.AtSymbols(rs.EulerAngles("ZXZ")),
    "gough-stewart-a-beams": rs.AtSymbols(),
    "gough-stewart-b": rs.AtSymbols(),
    "hexapod": rs.AtSymbols(),
    "six-joint-arm": rs.AtSymbols(),
    "tripteron": rs.AtSymbols(),
    "two-link-arm": rs.AtSymbols(),
    "us-ups": rs.AtHome(),
}
QUICK = ("3-rrr", "gough-stewart-b", "two-link-arm")


def robot_and_answers(name):
    """A derivation, and values of the arguments of its program with K."""
    robot, pose = rs.load(name, symbols=rs.ALL_PARAMETERS), POSED[name]
    derivation = rs.derive(robot, pose=pose)
    arguments = [s.name for s in program(derivation).arguments]
    answers = closed_places(place_robot(robot, pose), sets=2, poses=2)
    return derivation, [([float(at[x]) for x in arguments], own.K) for at, own, _ in answers]


@pytest.mark.needs("a C compiler")
@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=[] if x in QUICK else pytest.mark.slow) for x in POSED]
)
def test_programs_give_the_stiffness_of_a_robot(name, tmp_path):
    derivation, answers = robot_and_answers(name)
    assert answers
    for f in (in_c(derivation, tmp_path), in_python(derivation)):
        for values, K in answers:
            assert largest_difference(np.asarray(f(*values)), K) < 1e-12


@pytest.mark.needs("Octave")
@pytest.mark.parametrize(
    "names", [QUICK[1:], pytest.param(POSED, marks=pytest.mark.slow)], ids=["few", "all"]
)
def test_octave_gives_the_stiffness_of_robots(names, tmp_path):
    lines, expected = [], []
    for name in names:
        derivation, answers = robot_and_answers(name)
        own = f"robot_{name.replace('-', '_')}_"
        (tmp_path / f"{own}.m").write_text(matlab_function(derivation, own), encoding="utf-8")
        for values, K in answers:
            given = ", ".join(map(repr, values))
            lines.append(f"printf('%.17g ', {own}({given})'); printf('\\n');")
            expected.append(K)
    rows = octave(tmp_path, "\n".join(lines) + "\n").splitlines()
    for row, K in zip(rows, expected, strict=True):
        assert largest_difference(np.array(row.split(), dtype=float).reshape(K.shape), K) < 1e-12


def test_julia_agrees_with_the_numerical_form_at_a_general_pose(tmp_path):
    derivation = rs.derive("3-rpr", pose=rs.AtSymbols())
    robot = rs.load("3-rpr", symbols=rs.ALL_PARAMETERS)
    values = {**robot.nominal, "x": 0.02, "y": -0.03, "gamma": 0.2}
    given = [values[s.name] for s in derivation.symbols]
    expected = rs.stiffness(robot.numeric, [0.02, -0.03, 0.2]).K
    assert largest_difference(READERS["julia"](derivation, tmp_path)(*given), expected) < 1e-12


def test_a_program_takes_the_vectors_where_they_are_shorter():
    derivation = rs.derive("orthoglide", pose=rs.AtSymbols())
    steps = rs.derive("orthoglide", pose=rs.AtSymbols(), form=rs.Steps())
    assert program(derivation).operations < 0.6 * program(steps).operations
    assert program(derivation).arguments == program(steps).arguments
    assert "d_1_x" in python_function(derivation)
