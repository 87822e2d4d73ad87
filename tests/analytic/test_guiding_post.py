"""A Tricept at a general pose: its post of a universal joint and a slide decides the rotation."""

from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic.export import python_function

TRICEPT = Path(__file__).parents[2].joinpath("examples", "tricept.yaml").read_text()
RAM = """\
      - type: telescope
        direction: -z
        role: passive
        beams:
          - {share: 1, material: steel, section: ram}
"""
PUSHED = """\
      - {type: prismatic, axis: z, role: passive, home: -h}
      - {type: beam, to: [0, 0, 300 mm], material: steel, section: ram}
      - {type: rigid, to: [0, 0, -300 mm]}
"""
TURN = "    base: {turn: [{z: 25 deg}]}\n    platform: {turn: [{z: 25 deg}]}\n"
VARIANTS = {
    "as shipped": (),
    "other order": (("axes: [x, y], role", "axes: [y, x], role"),),
    "inclined axis": (("axes: [x, y], role", "axes: [[1, 0, 1], [0, 1, 0]], role"),),
    "turned base": (("  - name: ram\n", f"  - name: ram\n{TURN}"),),
    "upside down": (("home: {at: [0, 0, -h]}", "home: {at: [0, 0, h]}"), ("n: -z", "n: z")),
    "slide the other way": ((RAM, PUSHED),),
}


def written(folder, changes):
    path, text = folder / "tricept.yaml", TRICEPT
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    path.write_text(text)
    return path


@pytest.mark.parametrize("variant", VARIANTS)
def test_formulas_agree_with_numbers_at_random_poses(variant, tmp_path):
    robot = rs.load(written(tmp_path, VARIANTS[variant]), symbols=("R", "h", "k"))
    formula = rs.derive(robot, pose=rs.AtSymbols())
    assert {"x", "y", "z"} <= {s.name for s in formula.symbols}
    assert formula.following == ()
    space: dict = {}
    exec(python_function(formula), space)  # noqa: S102
    random, home = np.random.default_rng(3), robot.numeric.home.p
    for shift in random.uniform(-0.5, 0.5, (10, 3)):
        values = {**robot.nominal, **dict(zip("xyz", home + shift, strict=True))}
        K = space["stiffness"](**{s.name: values[s.name] for s in formula.symbols})
        expected = rs.stiffness(robot.numeric, home + shift).K
        scale = np.sqrt(np.diag(expected))
        assert np.max(np.abs(K - expected) / np.outer(scale, scale)) < 1e-12


def test_a_point_in_numbers_leaves_the_dimensions(tmp_path):
    robot = rs.load(written(tmp_path, ()), symbols=("R", "h", "k"))
    formula = rs.derive(robot, pose=rs.AtCoordinates({"x": 0.1, "y": -0.2}))
    expected = rs.stiffness(robot.numeric, [0.1, -0.2, -1.2]).K
    values = {s.name: robot.nominal[s.name] for s in formula.symbols}
    np.testing.assert_allclose(formula.lambdify()(**values), expected, atol=1e-12 * expected.max())


def test_a_post_beside_the_point_is_refused_with_its_reason(tmp_path):
    aside = "    base: {at: [50 mm, 0, 0]}\n    platform: {at: [50 mm, 0, 0]}\n"
    path = written(tmp_path, (("  - name: ram\n", f"  - name: ram\n{aside}"),))
    with pytest.raises(rs.InputError, match=r"'ram': got 'a leg without .*the origin"):
        rs.derive(path, pose=rs.AtSymbols())
