"""Formulas hold for the assembly mode that numbers choose, by home coordinates and limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.robots import robot_file
from tests.analytic.export.programs import in_all
from tests.files import FILES

AT = {"x": 1e-3, "y": -2e-3, "z": -0.6, "alpha_P": 3e-3, "beta": -2e-3, "gamma": 4e-3}
TURN = Rotation.from_euler("xyz", [AT["alpha_P"], AT["beta"], AT["gamma"]])
POSE = RigidTransform.from_components([AT["x"], AT["y"], AT["z"]], TURN)


@pytest.mark.parametrize("pose", [rs.AtHome(), rs.AtSymbols()])
def test_another_posture_is_refused(pose, tmp_path):
    """Beyond r cos(alpha) = l/2 the home coordinate of a drive is nearer to the other posture."""
    robot = rs.load("hexaglide", symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot, pose=pose)
    conditions = {str(x.expression) for x in formula.conditions}
    assert "l - 2*r*cos(alpha)" in conditions
    calls = [*in_all(formula, tmp_path), formula.lambdify()]
    for r, holds in ((0.3, True), (0.517, True), (0.5185, False), (0.6, False)):
        all_values = {**robot.nominal, **AT, "r": r}
        values = {x.name: all_values[x.name] for x in formula.symbols}
        own = rs.load("hexaglide", {"r": r})
        K = rs.stiffness(own).K if pose == rs.AtHome() else rs.stiffness(own, POSE).K
        for call in calls:
            if holds:
                np.testing.assert_allclose(call(*values.values()), K, atol=1e-9 * K.max())
                continue
            with pytest.raises((ValueError, rs.NoAnswerError), match="does not hold"):
                call(*values.values())


MOTOR, PIN = "role: actuated, stiffness: k", "axis: z, role: passive"
PLUS, FREE = "elbow: plus", {"  elbow: minus": "  #"}
VARIANTS = {
    "crank": ("hexa", {**FREE, "limits: [-60 deg, 100 deg]": "home: -60 deg"}, "R"),
    "limits of a crank": ("3-rrr", {PLUS: "", MOTOR: f"{MOTOR}, limits: [-20 deg, 50 deg]"}, "l1"),
    "two coordinates": (
        "3-rrr",
        {PLUS: "", MOTOR: f"{MOTOR}, home: 30 deg", PIN: f"{PIN}, home: 30 deg"},
        "l2",
    ),
    "limits of a slide": ("3-prs", {**FREE, "[0, 250 mm]": "[150 mm, 1 m]"}, "l"),
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_formula_holds_where_numbers_choose_its_posture(variant, tmp_path):
    name, changes, parameter = VARIANTS[variant]
    text = robot_file(name).read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    robot = rs.load(path, symbols=(parameter,))
    formula = rs.derive(robot)
    free, conditioned = replace(formula, conditions=()).lambdify(), formula.lambdify()
    same = []
    for value in robot.nominal[parameter] * np.linspace(0.605, 1.8, 25):
        try:
            K = rs.stiffness(robot.substituted({parameter: value})).K
        except rs.RobostiffError:
            continue
        if free.holds(value):
            same.append(bool(np.abs(free(value) - K).max() < 1e-7 * np.abs(K).max()))
            holds = bool(conditioned.holds(value))
            assert holds == same[-1], value
    assert any(same)
    assert not all(same)


def test_conditions_of_cranks_with_limits_and_homes_of_their_rods_end(tmp_path):
    # The absolute value of a long difference was multiplied out, which took minutes.
    text = robot_file("delta").read_text()
    changes = {
        "i*120 deg - 120 deg": "i*120 deg",
        "stiffness: k}": "stiffness: k, limits: [-90 deg, 60 deg]}",
        "axes: [y, x], role: passive": "axes: [y, x], role: passive, home: [30 deg, 0]",
        "elbow: minus": "#",
    }
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "delta.yaml"
    path.write_text(text)
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot)
    nearer = [x for x in formula.conditions if "nearer to its home coordinates" in x.words]
    assert {x.leg for x in nearer} == {"leg1", "leg2", "leg3"}
    for a in (0.3, 0.4):
        values = {**robot.nominal, "a": a}
        K = rs.stiffness(robot.substituted(values)).K
        found = formula.lambdify()(**{x.name: values[x.name] for x in formula.symbols})
        np.testing.assert_allclose(found, K, atol=1e-9 * K.max())


def test_two_postures_equally_near_to_home_are_no_disagreement():
    # Numbers at parameters nearby stood in the other one: "one is wrong, which is a fault".
    robot = rs.load(FILES / "slides.yaml", symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot).lambdify()
    answered = 0
    for o in (-0.3, -0.01, 0.01, 0.3):
        values = {**robot.nominal, "o": o}
        at = {x: values[x] for x in K.arguments}
        if K.holds(**at):
            expected = rs.stiffness(robot.substituted(values)).K
            assert K(**at) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
            answered += 1
    assert answered == 2
