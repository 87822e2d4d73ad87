"""Results of many poses, one after the other; those of one pose are no sequence."""

import numpy as np
import pytest

import robostiff as rs

POSE = [0.06, 0.02, 0.9, 0, 0.17, 0]
LOAD = [100, 0, -200, 0, 0, 0]


def results(pose):
    hexapod, cables = rs.load("hexapod"), rs.load("cable-8")
    yield rs.stiffness(hexapod, pose)
    yield rs.deflection(hexapod, pose, LOAD)
    yield rs.equilibrium(hexapod, pose, LOAD)
    yield rs.cable_stiffness(cables, np.zeros_like(pose))


def test_many_are_given_one_by_one():
    for many in results(np.tile(POSE, (3, 1))):
        assert [one.batch_shape for one in many] == [()] * 3
    rows = rs.stiffness(rs.load("hexapod"), np.tile(POSE, (2, 3, 1)))
    assert [row.batch_shape for row in rows] == [(3,), (3,)]


def test_one_is_no_sequence():
    """`list` of one was empty, as of a sequence without entries."""
    for one in results(np.array(POSE)):
        with pytest.raises(TypeError, match="0-d array"):
            list(one)
    assert len(list(rs.modes(rs.load("hexapod"), POSE))) > 100
