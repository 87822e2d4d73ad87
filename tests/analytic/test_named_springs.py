"""Moduli, products of beams and stiffnesses of drives that are numbers have names in formulas."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import AtHome, AtSymbols, Closed, Steps
from robostiff.analytic.export import derivation_text
from robostiff.analytic.placement.agreement import closed_places
from robostiff.analytic.placement.robot_placement import place_robot
from robostiff.elastostatics import matrix_distance
from robostiff.errors import InputError
from tests.analytic.export.programs import in_python
from tests.files import FILES

DATA = Path(__file__).parent / "data"
# Names that formulas take are lengths here.
ARM = (DATA / "arm-of-taken-names.yaml").read_text(encoding="utf-8")
LONG = 1000  # a numerator or denominator that no geometry of these robots has


@pytest.fixture(scope="module")
def arm():
    return rs.load(DATA / "arm-of-taken-names.yaml", symbols=rs.ALL_PARAMETERS)


def lines_of(derivation):
    return derivation_text(derivation).splitlines()


def values_of_names(derivation):
    return {str(d.symbol): d.expression for d in (derivation.named or derivation).definitions}


def largest_distance(robot, pose, K, sets=4):
    """Largest difference of K, a function of values by name, from the numbers."""
    placed = place_robot(robot, pose)
    places = closed_places(placed, sets=sets)
    return max(matrix_distance(K(at), result.K, placed.length) for at, result, _ in places)


@pytest.mark.parametrize(
    ("pose", "form"),
    [
        (AtHome(), None),
        (AtHome(), Steps()),
        (AtHome(), Closed()),
        (AtSymbols(), None),
        (AtSymbols(), Steps()),
    ],
)
def test_functions_have_the_numbers_of_the_model(arm, pose, form):
    derivation = rs.derive(arm, pose=pose, form=form)
    assert not {"E_1", "EA_2", "k_2"} & {s.name for s in derivation.free_symbols}
    for function in (derivation.lambdify(), in_python(derivation)):
        assert largest_distance(arm, pose, lambda at, K=function: K(**at)) < 1e-11


@pytest.mark.parametrize(
    "name", ["agile-eye", "orthoglide", "tripteron", "3-rpr-beams", "six-joint-arm", "scara"]
)
def test_steps_have_no_numbers_of_springs(name):
    derivation = rs.derive(name, pose=AtSymbols(), form=Steps())
    for d in derivation.definitions:
        if not d.parts:
            numbers = d.expression.atoms(sp.Rational)
            assert all(max(abs(x.p), x.q) < LONG for x in numbers), d


def test_a_material_without_a_name_is_that_of_its_beams(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.replace("material: steel", "material: {E: 130 GPa, G: 5 GPa}", 1))
    lines = lines_of(rs.derive(path))
    assert "E_1: Young's modulus of the material of first, 130 GPa" in lines
    assert "E_3: Young's modulus of steel, 210 GPa" in lines


def test_beams_in_which_shear_counts_stay_as_they_are(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.replace("name: third", "name: third\n        theory: timoshenko"))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot)
    assert not any("third" in d.parts for d in derivation.definitions)
    function = derivation.lambdify()
    assert largest_distance(robot, AtHome(), lambda at: function(**at)) < 1e-11


def test_values_go_where_the_names_are(arm):
    derivation = rs.derive(arm).subs({"b": sp.Rational(1, 25)})
    assert "EA_2" not in values_of_names(derivation)  # a number is put in where it is used
    at = {"E": 0.3, "EA_1": 0.4, "k_1": 0.1, "d": 0.03}
    K = np.array(derivation.substituted(at), dtype=float)
    assert matrix_distance(K, rs.stiffness(arm.substituted({**at, "b": 0.04})).K, 0.5) < 1e-12


def test_a_robot_of_numbers_stays_one():
    derivation = rs.derive("two-link-arm", symbols=())
    assert not derivation.free_symbols
    assert not any(d.parts for d in derivation.definitions)


def test_an_arm_of_several_links_is_in_steps_unless_a_closed_form_is_asked_for():
    arm = FILES / "2r-beams.yaml"
    derivation = rs.derive(arm)
    assert not derivation.is_closed
    assert derivation.in_series is not None
    assert derivation_text(derivation) == derivation_text(rs.derive(arm, form=Steps()))
    assert rs.derive(arm, form=Closed()).is_closed
    assert rs.derive("planar-link").is_closed


def test_two_postures_that_meet_at_home_are_refused():
    robot = rs.load("gantry-tau", symbols=rs.ALL_PARAMETERS)
    with pytest.raises(InputError, match="two postures of leg 'arm3' that meet at home"):
        rs.derive(robot.substituted({"top": 0.9}))  # as long as the rods
    derivation = rs.derive(robot).subs({"top": sp.Rational(9, 10)})
    at = {"l": 0.914, "w": 0.5, "d": 0.3, "a": 0.15, "k": 5e7}
    wanted = rs.stiffness(robot.substituted({"top": 0.9, **at})).K
    assert matrix_distance(derivation.lambdify()(**at), wanted, 0.5) < 1e-12
