"""Lengths that may have either sign: a parameter that is zero in the file."""

import numpy as np
import pytest

import robostiff as rs
from tests.files import FILES


@pytest.mark.parametrize("x", [0.0, 0.1, -0.2, -0.9])
def test_the_size_of_such_a_length_is_in_steps(x):
    # It was refused: "got 'Abs(500*x + 237)', expected a formula of ...".
    robot = rs.load(FILES / "slide-of-either-sign.yaml", symbols=rs.ALL_PARAMETERS)
    K = rs.derive(robot).lambdify()
    values = {**robot.nominal, "x": x}
    numbers = rs.stiffness(robot.substituted(values)).K
    found = K(**{name: values[name] for name in K.arguments})
    assert found == pytest.approx(numbers, abs=1e-9 * np.abs(numbers).max())
