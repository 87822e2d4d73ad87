"""Rotations on recorded entries against those in floats."""

import numpy as np
import pytest

from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.record import Entry, Record, is_number

AXES = ([0, 0, 1.0], [-1.0, 0, 0], [0.6, 0, 0.8], [2 / 3, -1 / 3, 2 / 3])
ANGLES = [-2.9, -0.4, 0.0, 1e-9, 1.3]


def sampled(R: np.ndarray, count: int) -> np.ndarray:
    """A recorded matrix in floats (count, 3, 3)."""
    rows = [x.sample if isinstance(x, Entry) else np.full(count, float(x)) for x in R.flat]
    return np.moveaxis(np.reshape(rows, (3, 3, count)), -1, 0)


@pytest.mark.parametrize("axis", AXES)
def test_turn_about_an_axis(axis: list[float]):
    e = np.array(axis)
    q = np.array([Record({"q": ANGLES}).input("q")], dtype=object)
    R = turn_about(e, q[..., 0])
    assert np.allclose(sampled(R, 5), turn_about(e, np.array(ANGLES)), rtol=0, atol=1e-15)


def test_turn_about_a_frame_axis_is_a_cosine_and_a_sine():
    record = Record({"q": ANGLES})
    R = turn_about(np.array([0, 0, 1.0]), np.array(record.input("q"), dtype=object))
    entries = {x.step for x in R.flat if isinstance(x, Entry)}
    assert len(entries) == 3  # cos, sin, -sin
    assert R[2].tolist() == [0, 0, 1]


def test_rotation_vectors_of_all_sizes():
    r = np.array([[0.0, 0, 0], [1e-12, 0, -1e-13], [0.3, -0.2, 0.5], [2.0, 2.0, -1.0], [3, 2, 9]])
    record = Record({name: own.tolist() for name, own in zip("abc", r.T, strict=True)})
    R = turn_by_vector(np.array([record.input(name) for name in "abc"], dtype=object))
    assert np.allclose(sampled(R, 5), turn_by_vector(r), rtol=0, atol=1e-15)


@pytest.mark.parametrize("k", range(3))
def test_a_rotation_vector_along_a_frame_axis_is_a_turn_about_it(k: int):
    record = Record({"a": ANGLES})
    six = np.zeros(6, dtype=object)
    six[3 + k] = record.input("a")
    R = FormulaPose.of_coordinates(six).R
    vectors = np.outer(ANGLES, np.eye(3)[k])
    assert np.allclose(sampled(R, 5), turn_by_vector(vectors), rtol=0, atol=1e-15)
    assert sum(not is_number(x) for x in R.flat) == 4


def test_a_pose_of_numbers_records_nothing():
    pose = FormulaPose.of_coordinates(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
    R = np.array(pose.R, dtype=float)
    assert np.allclose(R, turn_by_vector(np.array([0.4, 0.5, 0.6])), rtol=0, atol=1e-15)
