"""Formulas hold for the assembly mode that numbers choose, by home coordinates and limits."""

import html
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import robostiff as rs
from robostiff.analytic.export import (
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_text,
    derivation_typst,
)
from robostiff.robots import robot_file
from tests.analytic.export.programs import in_all

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


def test_texts_say_where_the_formula_holds():
    formula = rs.derive("hexaglide", symbols=("l", "r", "k"))
    words = "'leg1' at home is nearer to its home coordinates than in another posture"
    for write, delta in (
        (derivation_text, "Delta_1 = l - 2*r*"),
        (derivation_latex, r"\Delta_{1}"),
        (derivation_markdown, r"\Delta_{1}"),
        (derivation_typst, "Delta_(1)"),
        (derivation_html, "Δ"),
    ):
        text = " ".join(html.unescape(write(formula)).split())
        assert "these differences are positive" in text, write
        assert delta in text, write
        plain = re.sub(r"['’\\]", "", text)
        assert words.replace("'", "") in plain, write


SLIDES = """\
robostiff: 1
name: slides
source: rods that leave their carriages upwards or downwards, equally near to the home coordinates
parameters: {o: 0 mm, l: 800 mm, R: 600 mm, r: 60 mm, k: 8e6 N/m}
home: {}
coordinates: [x, y, z]
legs:
  repeat: {count: 3, variable: i}
  let: {phi: i*120 deg}
  base: {at: [R*cos(phi), R*sin(phi), 0], turn: [{z: phi}]}
  chain:
    - {type: prismatic, name: drive, axis: z, role: actuated, stiffness: k, home: -o}
    - {type: universal, axes: [y, x], role: passive}
    - {type: beam, name: rod, to: [0, 0, -l], y_axis: x, material: steel,
       section: {circle: {diameter: 30 mm}}}
    - {type: universal, axes: [x, y], role: passive}
  platform: {at: [r*cos(phi), r*sin(phi), 0], turn: [{z: phi}]}
"""


def test_two_postures_equally_near_to_home_are_no_disagreement(tmp_path):
    # Numbers at parameters nearby stood in the other one: "one is wrong, which is a fault".
    file = tmp_path / "slides.yaml"
    file.write_text(SLIDES, encoding="utf-8")
    robot = rs.load(file, symbols=rs.ALL_PARAMETERS)
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
