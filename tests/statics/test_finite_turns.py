"""Turns of parts, by series and by angles."""

import numpy as np
import pytest

from robostiff.spatial.rotation import matrix_of_rotation
from robostiff.statics.chains.moving_chain import FURTHEST_TURN, FiniteTurn


def test_turns_have_one_value_on_both_sides_of_where_series_end():
    axis = np.array([[0.36, 0.48, 0.8]])
    inside, outside = (axis * FURTHEST_TURN * (1 + s * 1e-13) for s in (-1, 1))
    near, far = FiniteTurn.of(inside), FiniteTurn.of(outside)
    assert near.factors == pytest.approx(far.factors, rel=1e-10)
    assert near.R == pytest.approx(matrix_of_rotation(inside), abs=1e-15)
    assert far.R == pytest.approx(matrix_of_rotation(outside), abs=1e-15)
