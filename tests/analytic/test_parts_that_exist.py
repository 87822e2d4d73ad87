"""Formulas at values at which a section, a material or a drive does not exist are refused."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import c_function, julia_function, matlab_function, python_function
from tests.analytic.export.small_readers import julia, matlab
from tests.analytic.export.test_c_code import COMPILER, called, compiled

ARM = """\
robostiff: 1
name: arm
source: of this test
materials: {{own: {material}}}
legs:
  - name: arm
    chain:
      - {{type: revolute, axis: z, role: actuated, stiffness: k*(1 - p)}}
      - {{type: beam, name: bar, to: [1, 0, 0], y_axis: y, material: own, section: {section}}}
parameters: {{k: 1e6 N m/rad, p: 0.2, b: 60 mm, h: 40 mm, t: 5 mm, w: 8 mm, nu: 0.3, E: 70 GPa}}
"""
OWN = "{E: E, poisson_ratio: nu}"
BOX = "{box: {width_y: b, height_z: h, wall: t}}"
I = "{i: {flange_width: b, height: h, web_thickness: w, flange_thickness: t}}"
PIPE = "{tube: {outer_diameter: b, inner_diameter: b - 2*t}}"
CASES = {
    "circle": (OWN, "{circle: {diameter: h - t}}", {"t": 0.05}, "diameter .* is more than 0"),
    "tube": (OWN, "{tube: {outer_diameter: b, inner_diameter: h}}", {"h": 0.07}, "outer diameter"),
    "no hollow": (OWN, PIPE, {"t": 0.04}, "inner diameter .* is more than 0"),
    "low box": (OWN, BOX, {"t": 0.025}, "less than half the height, h/2"),
    "narrow box": (OWN, BOX, {"b": 0.009}, "less than half the width, b/2"),
    "full box": (OWN, BOX, {"t": 0.02}, "less than half the height, h/2"),
    "web": (OWN, I, {"w": 0.07}, "less than the flange width, b"),
    "flange": (OWN, I, {"t": 0.021}, "less than half the height, h/2"),
    "properties": (OWN, "{properties: {A: b*h - t*w, Iy: w**4, Iz: w**4, J: w**4}}", {"t": 1}, "A"),
    "Poisson ratio": (OWN, BOX, {"nu": 0.5}, "between -1 and 0.5"),
    "modulus": ("{E: E*(1 - nu), G: E}", BOX, {"nu": 1.5}, "modulus E .* is more than 0"),
    "drive": (OWN, BOX, {"p": 1.5}, "stiffness .* is more than 0"),
}


@pytest.mark.parametrize("case", CASES)
def test_parts_that_do_not_exist_are_refused(case, tmp_path):
    material, section, bad, words = CASES[case]
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.format(material=material, section=section))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot)
    names = [s.name for s in formula.symbols]
    usual = {name: robot.nominal[name] for name in names}
    wrong = {**usual, **{name: float(x) for name, x in bad.items()}}
    for refused in (
        lambda: rs.load(path, bad),
        lambda: robot.substituted({**usual, **bad}),
    ):
        with pytest.raises(rs.InputError):
            refused()
    leg = rs.derive(robot, leg="arm")
    for method in (formula.subs, formula.substituted, leg.subs, leg.substituted):
        with pytest.raises(rs.InputError, match=words):
            method(wrong)
    with pytest.raises(rs.NoAnswerError, match=words):
        formula.lambdify()(**wrong)
    of_python: dict = {}
    exec(python_function(formula), of_python)  # noqa: S102
    calls = [lambda at: of_python["stiffness"](**at)]
    for read, written in ((julia, julia_function), (matlab, matlab_function)):
        other = read(written(formula, name="K_of_arm"))
        calls.append(lambda at, other=other: other(*at.values()))
    K = rs.stiffness(rs.load(path)).K
    for call in calls:
        np.testing.assert_allclose(call(usual), K, rtol=1e-12, atol=1e-9 * K.max())
        with pytest.raises(ValueError, match="does not hold"):
            call(wrong)
    if COMPILER is not None and case in ("low box", "flange", "drive"):
        function = compiled(c_function(formula), tmp_path)
        np.testing.assert_allclose(called(function, usual.values(), 6), K, atol=1e-9 * K.max())
        assert np.isnan(called(function, wrong.values(), 6)).all()


def test_a_rectangle_is_refused_by_its_robot(tmp_path):
    """Its torsion constant, of two sides in symbols, has no formula in export."""
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.format(material=OWN, section="{rectangle: {width_y: b, height_z: h - t}}"))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    (bar,) = (x for x in robot.legs[0].chain.elements if getattr(x, "name", "") == "bar")
    _, height = bar.elasticity.bounds
    assert [str(x) for x in height.differences.values()] == ["h - t"]
    with pytest.raises(rs.InputError, match=r"height of the rectangle: got -0\.01"):
        robot.substituted({**{str(x): robot.nominal[str(x)] for x in robot.symbols}, "t": 0.05})


@pytest.mark.parametrize("height", ["b", "2*b", "b/3"])
def test_a_rectangle_of_one_size_has_its_torsion_in_numbers(height, tmp_path):
    """It was refused: formulas have no exponentials."""
    path = tmp_path / "arm.yaml"
    section = f"{{rectangle: {{width_y: b, height_z: {height}}}}}"
    path.write_text(ARM.format(material=OWN, section=section))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot).lambdify()
    for b in (0.06, 0.01):
        expected = rs.stiffness(rs.load(path, parameters={"b": b})).K
        values = {**robot.nominal, "b": b}
        K = formula(**{s.name: values[s.name] for s in robot.symbols if s.name not in "twh"})
        np.testing.assert_allclose(K, expected, rtol=1e-11, atol=1e-11 * expected.max())


def test_a_rectangle_of_two_sizes_is_refused_with_what_to_write(tmp_path):
    path = tmp_path / "arm.yaml"
    section = "{rectangle: {width_y: b, height_z: h}}"
    path.write_text(ARM.format(material=OWN, section=section))
    with pytest.raises(rs.InputError, match=r"J: J_t} with J_t as a parameter"):
        rs.derive(path)


MATRIX = """\
robostiff: 1
name: arm
source: of this test
legs:
  - name: arm
    chain:
      - {{type: revolute, axis: z, role: actuated, stiffness: k}}
      - type: spring
        name: part
        {kind}:
          - [a, 0, 0, 0, 0, 0]
          - [0, a, 0, 0, 0, c]
          - [0, 0, a, 0, 0, 0]
          - [0, 0, 0, b, 0, 0]
          - [0, 0, 0, 0, b, 0]
          - [0, c, 0, 0, 0, b]
parameters: {{k: 1e6 N m/rad, a: 2, b: 3, c: 1}}
"""


@pytest.mark.parametrize("kind", ["stiffness", "compliance"])
def test_a_matrix_with_a_negative_eigenvalue_is_no_spring(kind, tmp_path):
    """Only its diagonal was asked: K was given where the numbers refuse the spring."""
    path = tmp_path / "arm.yaml"
    path.write_text(MATRIX.format(kind=kind))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot)
    usual = {str(x): robot.nominal[str(x)] for x in robot.symbols}
    for c in (0.5, 2.44):
        K = rs.stiffness(rs.load(path, {"c": c})).K
        np.testing.assert_allclose(
            formula.lambdify()(**{**usual, "c": c}), K, rtol=1e-9, atol=1e-12 * K.max()
        )
    wrong = {**usual, "c": 2.46}
    with pytest.raises(rs.InputError, match="no negative eigenvalue"):
        rs.load(path, {"c": 2.46})
    with pytest.raises(rs.InputError, match="no negative eigenvalue"):
        robot.substituted(wrong)
    with pytest.raises(rs.InputError, match="determinant of the rows"):
        formula.substituted(wrong)
    with pytest.raises(rs.NoAnswerError, match="determinant of the rows"):
        formula.lambdify()(**wrong)
