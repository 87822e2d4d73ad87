"""Lengths that may have either sign: a parameter that is zero in the file."""

import numpy as np
import pytest

import robostiff as rs

SLIDE = """\
robostiff: 1
name: slide
source: a beam behind a slide whose home coordinate is zero in the file
planar: true
parameters: {phi: -34 deg, k: 2e4 N m/rad, o: 74 mm, x: 0 mm, I: 0.7e-7 m^4}
legs:
  - name: arm
    chain:
      - {type: revolute, name: j0, axis: z, role: actuated, stiffness: k, home: phi}
      - {type: rigid, to: [o, o, 0]}
      - {type: prismatic, name: j1, axis: x, role: actuated, stiffness: 4.8e6 N/m, home: x}
      - {type: beam, name: last, to: [474 mm, 0, 0], y_axis: y, material: aluminium,
         section: {properties: {A: 2e-3, Iy: 1e-7, Iz: I, J: 1e-7}}}
"""


@pytest.mark.parametrize("x", [0.0, 0.1, -0.2, -0.9])
def test_the_size_of_such_a_length_is_in_steps(tmp_path, x):
    # It was refused: "got 'Abs(500*x + 237)', expected a formula of ...".
    file = tmp_path / "slide.yaml"
    file.write_text(SLIDE, encoding="utf-8")
    robot = rs.load(file, symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot).lambdify()
    values = {**robot.nominal, "x": x}
    numbers = rs.stiffness(robot.substituted(values)).K
    found = K(**{name: values[name] for name in K.arguments})
    assert found == pytest.approx(numbers, abs=1e-9 * np.abs(numbers).max())
