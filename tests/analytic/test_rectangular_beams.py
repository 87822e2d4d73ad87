"""Beams of rectangular section, whose torsion constant formulas take as a number."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.analytic import derive_robot
from robostiff.analytic.export import python_function

ARM = """\
robostiff: 1
name: arm
source: of this test
legs:
  - name: arm
    chain:
      - {type: revolute, axis: z, role: actuated, stiffness: k}
      - {type: beam, to: [l, 0, 0], y_axis: y, material: steel, section: bar}
parameters: {k: 2e4 N m/rad, l: 400 mm}
sections:
  bar: {rectangle: {width_y: 20 mm, height_z: 35 mm}}
"""


def test_an_arm_of_a_rectangular_bar_has_a_formula(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM)
    derivation = derive_robot(rs.load(path, symbols=("k", "l")))
    space: dict = {}
    exec(python_function(derivation), space)  # noqa: S102
    K = next(f for name, f in space.items() if name.startswith("stiffness"))(k=2e4, l=0.4)
    wanted = rs.stiffness(rs.load(path)).K
    assert np.abs(np.asarray(K) - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.parametrize("sides", [(0.02, 0.035), (0.05, 0.01)])
def test_exact_sides_give_the_torsion_constant_of_numbers(sides):
    import sympy as sp

    exact = rs.rectangle(*(sp.Rational(str(side)) for side in sides))
    assert exact.J.is_Rational
    assert float(exact.J) == pytest.approx(rs.rectangle(*sides).J, rel=1e-15)
