"""Formulas at values at which a section, a material or a drive does not exist are refused."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import differentiate
from tests.analytic.export.programs import in_all

pytestmark = pytest.mark.filterwarnings("ignore:.*nothing in the file uses|.*in N/um.")

ARM = """\
robostiff: 1
name: arm
source: of this test
materials: {{own: {material}}}
legs:
  - name: arm
    chain:
      - {{type: revolute, axis: z, role: actuated, stiffness: k*(1 - p)}}
      - {{type: beam, theory: euler-bernoulli, name: bar, to: [1, 0, 0], y_axis: y, material: own,
         section: {section}}}
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
    "web": (OWN, I, {"w": 0.07, "h": 0.2}, "less than the flange width, b"),
    "low web": (OWN, I, {"w": 0.035}, "less than the height between the flanges"),
    "flange": (OWN, I, {"t": 0.021}, "less than (half the height, h/2|the height between)"),
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
    for refused in (lambda: rs.load(path, bad), lambda: robot.substituted({**usual, **bad})):
        with pytest.raises(rs.InputError):
            refused()
    leg = rs.derive(robot, leg="arm")
    for method in (formula.subs, formula.substituted, leg.subs, leg.substituted):
        with pytest.raises(rs.InputError, match=words):
            method(wrong)
    with pytest.raises(rs.NoAnswerError, match=words):
        formula.lambdify()(**wrong)
    K = rs.stiffness(rs.load(path)).K
    for call in in_all(formula, tmp_path):
        np.testing.assert_allclose(call(*usual.values()), K, rtol=1e-12, atol=1e-9 * K.max())
        with pytest.raises(ValueError, match="does not hold"):
            call(*wrong.values())


def test_a_rectangle_is_refused_by_its_robot(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.format(material=OWN, section="{rectangle: {width_y: b, height_z: h - t}}"))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    (bar,) = (x for x in robot.legs[0].chain.elements if getattr(x, "name", "") == "bar")
    _, height = bar.elasticity.bounds
    assert [str(x) for x in height.differences.values()] == ["h - t"]
    with pytest.raises(rs.InputError, match=r"height of the rectangle: got -0\.01"):
        robot.substituted({**{str(x): robot.nominal[str(x)] for x in robot.symbols}, "t": 0.05})


@pytest.mark.parametrize("sides", ["b, b", "b, 2*b", "b, b/3", "20 mm, 35 mm"])
def test_a_rectangle_of_one_size_has_its_torsion_in_numbers(sides, tmp_path):
    """It was refused: formulas have no exponentials."""
    path = tmp_path / "arm.yaml"
    width, height = sides.split(",")
    section = f"{{rectangle: {{width_y: {width}, height_z: {height}}}}}"
    path.write_text(ARM.format(material=OWN, section=section))
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    formula = rs.derive(robot).lambdify()
    for b in (0.06, 0.01):
        expected = rs.stiffness(rs.load(path, parameters={"b": b})).K
        values = {**robot.nominal, "b": b}
        K = formula(**{s.name: values[s.name] for s in robot.symbols if s.name not in "twh"})
        np.testing.assert_allclose(K, expected, rtol=1e-11, atol=1e-11 * expected.max())


def test_masses_are_no_condition_of_a_stiffness(tmp_path):
    path = tmp_path / "arm.yaml"
    heavy = "{E: E, poisson_ratio: nu, density: 7850 kg/m^3}"
    path.write_text(ARM.format(material=heavy, section=BOX))
    words = [own.words for own in rs.derive(path).conditions]
    assert any(own.startswith("wall of the box") for own in words)
    assert not any("mass" in own for own in words)


SIDES = [(0.06, 0.04), (0.04, 0.06), (0.05, 0.05), (0.002, 0.2), (0.2, 0.002), (0.05, 0.0501)]


def test_a_rectangle_of_two_sizes_has_its_torsion_in_any_order(tmp_path):
    """It was refused: its torsion constant was one of the shorter and the longer side."""
    path = tmp_path / "arm.yaml"
    path.write_text(
        ARM.format(material=OWN, section="{rectangle: {width_y: b, height_z: h}}").replace(
            "role: actuated", "name: drive, role: actuated"
        )
    )
    robot = rs.load(path, symbols=rs.ALL_PARAMETERS)
    usual = {str(x): robot.nominal[str(x)] for x in robot.symbols}
    expected = [rs.stiffness(rs.load(path, {"b": b, "h": h})).K for b, h in SIDES]
    formula = rs.derive(robot)
    names = [str(x) for x in formula.symbols]
    calls = in_all(formula, tmp_path)
    calls += [rs.derive(robot, form=form).lambdify(*names) for form in (rs.Closed(), rs.Steps())]
    for (b, h), K in zip(SIDES, expected, strict=True):
        for call in calls:
            at = {**usual, "b": b, "h": h}
            found = np.asarray(call(*(at[name] for name in names)), dtype=float)
            # torsion alone is soft: its entry is compared by itself
            np.testing.assert_allclose(found, K, rtol=1e-12, atol=1e-12 * K.max())
            assert found[3, 3] == pytest.approx(K[3, 3], rel=1e-12)
    by_b = differentiate(formula, "b").lambdify()
    for b, h in SIDES[:3]:
        step = 1e-6 * b
        ends = [
            rs.stiffness(robot.substituted({**usual, "b": b + s * step, "h": h})).K[3, 3]
            for s in (1, -1)
        ]
        at = {name: {**usual, "b": b, "h": h}[name] for name in by_b.arguments}
        assert by_b(**at)[1][3, 3] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-7)


def test_a_kernel_takes_the_sides_of_a_rectangle(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.format(material=OWN, section="{rectangle: {width_y: b, height_z: h}}"))
    kernel = rs.compile(rs.load(path, symbols=("b", "h")), parameters=("b", "h"))
    b, h = np.array(SIDES).T
    poses = rs.JointCoordinates(np.zeros((len(SIDES), 1)))
    found = kernel.evaluate(poses, parameters={"b": b, "h": h}).values["K"]
    for own, sides in zip(found, SIDES, strict=True):
        K = rs.stiffness(rs.load(path, dict(zip("bh", sides, strict=True)))).K
        np.testing.assert_allclose(own, K, rtol=1e-11, atol=1e-11 * K.max())
        assert own[3, 3] == pytest.approx(K[3, 3], rel=1e-11)


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
