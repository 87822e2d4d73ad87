"""NumPy in chunks, machine code and one operation after the other give the same numbers."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff.compiled.codes import ArrayCode, MachineCode
from robostiff.record import (
    Program,
    Record,
    arc_cosine,
    arc_tangent,
    cosine,
    greater,
    least,
    reciprocal,
    sine,
    square_root,
)

NAMES = ("x", "y", "z")
needs_compiler = pytest.mark.needs("llvmlite")


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """Random operations on three inputs, of moderate values where the inputs are."""
    record = Record({name: [0.3 + 0.2 * i, 0.8 - 0.1 * i] for i, name in enumerate(NAMES)})
    known: list[Any] = [record.input(name) for name in NAMES]
    one = [
        sine,
        cosine,
        lambda a: -a,
        lambda a: square_root(a * a + 0.5),
        lambda a: reciprocal(a * a + 0.7),
        lambda a: arc_cosine(sine(a) * 0.9),
        lambda a: a * 0.5,
        lambda a: 1.25 - a,
    ]
    two = [
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: sine(a) * b,
        lambda a, b: a / (b * b + 1.5),
        least,
        arc_tangent,
        lambda a, b: greater(a, b) + a,
    ]
    for _ in range(draw(st.integers(1, 40))):
        a = known[draw(st.integers(0, len(known) - 1))]
        b = known[draw(st.integers(0, len(known) - 1))]
        made = (
            draw(st.sampled_from(one))(a)
            if draw(st.booleans())
            else draw(st.sampled_from(two))(a, b)
        )
        known.append(made)
    count = draw(st.integers(1, 6))
    places = draw(st.lists(st.integers(0, len(known) - 1), min_size=count, max_size=count))
    return Program.of(record, [*(known[i] for i in places), 2.5])


def evaluated(code: ArrayCode | MachineCode, inputs: np.ndarray) -> np.ndarray:
    outputs = np.full((code.rows, inputs.shape[1]), np.nan)
    code.evaluate(inputs, outputs)
    return outputs


def plainly(program: Program, inputs: np.ndarray) -> np.ndarray:
    rows = program.evaluate(dict(zip(program.inputs, inputs, strict=True)))
    return np.array([np.broadcast_to(row, inputs.shape[1]) for row in rows], dtype=float)


@settings(max_examples=30)
@given(programs())
def test_one_pose_after_the_other_is_the_same_before_and_after_a_function_is_made(program: Program):
    """Bit for bit, and None for what has no value."""
    code = ArrayCode(program)
    poses = np.random.default_rng(6).uniform(-1, 1, (3, 230))
    expected = plainly(program, poses)
    for pose, results in zip(poses.T, expected.T, strict=True):
        assert code.at_one(pose.tolist()) == [pytest.approx(x, rel=4e-16) for x in results]


def test_one_pose_without_a_value_is_none_before_and_after_a_function_is_made():
    code = ArrayCode(everything())
    for _ in range(230):
        assert code.at_one([0.3, 0.6, 0.9]) is not None
        assert code.at_one([0.3, 0.0, 0.9]) is None  # x / y
        assert code.at_one([3.0, 0.6, 0.9]) is None  # arc cosine


def everything() -> Program:
    record = Record({"x": [0.3], "y": [0.6], "z": [0.9]})
    x, y, z = (record.input(name) for name in NAMES)
    return Program.of(
        record,
        [
            x + y * z - 2,
            x / y,
            square_root(x * x + y),
            sine(x) * cosine(y),
            arc_cosine(x),
            arc_tangent(x, -z),
            least(x, y),
            greater(z, y),
            -x,
            x,
            4.0,
        ],
    )


@pytest.mark.parametrize("kind", [ArrayCode, pytest.param(MachineCode, marks=needs_compiler)])
@pytest.mark.parametrize("count", [0, 1, 3, 8191, 8192, 8193, 20000])
def test_any_number_of_poses(kind: type, count: int):
    inputs = np.random.default_rng(3).uniform(0.1, 0.9, (3, count))
    program = everything()
    assert np.allclose(evaluated(kind(program), inputs), plainly(program, inputs), rtol=1e-14)


@pytest.mark.parametrize("kind", [ArrayCode, pytest.param(MachineCode, marks=needs_compiler)])
def test_threads_give_the_same_bits(kind: type):
    inputs = np.random.default_rng(4).uniform(0.1, 0.9, (3, 50_001))
    code = kind(everything())
    alone, together = (np.empty((11, 50_001)) for _ in range(2))
    code.evaluate(inputs, alone, threads=1)
    code.evaluate(inputs, together, threads=3)
    assert np.array_equal(alone, together)


@needs_compiler
def test_machine_code_takes_no_other_number_of_rows():
    code, rows = MachineCode(everything()), np.ones((20, 9))
    for inputs, outputs in ((2, 11), (4, 11), (3, 10), (3, 12)):
        with pytest.raises(ValueError, match="rows of inputs"):
            code.evaluate(rows[:inputs], rows[:outputs])


@pytest.mark.parametrize("kind", [ArrayCode, pytest.param(MachineCode, marks=needs_compiler)])
def test_pickled(kind: type):
    inputs = np.random.default_rng(5).uniform(0.1, 0.9, (3, 10))
    code = kind(everything())
    first = evaluated(code, inputs)  # compiled by now
    again = pickle.loads(pickle.dumps(code))  # noqa: S301
    assert np.array_equal(evaluated(again, inputs), first)
    assert again == code


def test_one_pose_has_the_numbers_of_a_batch_also_where_there_are_none():
    """One pose is computed on floats, which raise where arrays hold no number."""
    record = Record({"x": [0.3, 0.7], "y": [0.5, 0.2]})
    x, y = record.input("x"), record.input("y")
    entries = [
        square_root(1 - x * x),
        reciprocal(x),
        arc_cosine(x),
        least(square_root(y), x),
        least(x, square_root(y)),
        sine(x) * greater(x, y) + arc_tangent(y, x),
        x * 1e200 * x * 1e200 - y * 1e300 * 1e300,
    ]
    code = ArrayCode(Program.of(record, entries))
    inputs = np.array(
        [[0.3, 2.0, 0.0, 0.3, -0.0, 1e300, 0.9], [0.5, 0.5, 0.5, -1.0, 0.0, 0.1, 0.9]]
    )
    whole = np.empty((len(entries), inputs.shape[1]))
    code.evaluate(inputs, whole)
    assert np.isnan(whole).any()
    for k in range(inputs.shape[1]):
        alone = np.empty((len(entries), 1))
        code.evaluate(inputs[:, k : k + 1], alone)
        np.testing.assert_allclose(alone[:, 0], whole[:, k], rtol=1e-14)
