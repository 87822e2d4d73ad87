"""Misuse is an exception that says what came and what was expected."""

import numpy as np
import pytest

import robostiff as rs
from robostiff.spatial import skew


def test_forms_are_objects_with_names():
    assert rs.IndexRules().name == "index-rules"
    assert rs.Recursive() == rs.Recursive(groups=None)
    assert hash(rs.Recursive(groups=((1, 0),))) is not None


def test_shapes_are_checked_while_testing():
    jaxtyping = pytest.importorskip("jaxtyping")
    with pytest.raises(jaxtyping.TypeCheckError, match="parameter 'v'"):
        skew(np.zeros(4))
