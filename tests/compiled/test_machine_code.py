"""Functions of machine code against 40 digits and against NumPy, for vectors of any width."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from robostiff.compiled.codes import VectorFunction, this_processor
from robostiff.record import (
    Program,
    Record,
    arc_cosine,
    arc_tangent,
    cosine,
    greater,
    hyperbolic_tangent,
    least,
    reciprocal,
    sine,
    square_root,
)

pytestmark = pytest.mark.needs("llvmlite")

FUNCTIONS = {
    "sin": (sine, np.sin, mpmath.sin),
    "cos": (cosine, np.cos, mpmath.cos),
    "acos": (arc_cosine, np.arccos, mpmath.acos),
    "tanh": (hyperbolic_tangent, np.tanh, mpmath.tanh),
    "sqrt": (square_root, np.sqrt, mpmath.sqrt),
    "1/": (reciprocal, np.reciprocal, lambda x: 1 / x),
    "atan2": (arc_tangent, np.arctan2, mpmath.atan2),
    "min": (least, np.minimum, None),
    "greater": (greater, np.greater, None),
}
OF_TWO = ("atan2", "min", "greater")


def widths() -> list[int]:
    processor = this_processor()
    return [] if processor is None else [w for w in (1, 2, 4, 8) if w <= processor.width]


def computed(name: str, width: int, *rows: np.ndarray) -> np.ndarray:
    record = Record({"x": [0.3, 0.6], "y": [0.7, -0.2]})
    entries = [record.input(each) for each in "xy"[: len(rows)]]
    program = Program.of(record, [FUNCTIONS[name][0](*entries)])
    processor = this_processor()
    assert processor is not None
    function = VectorFunction.of(program, replace(processor, width=width))
    inputs, out = np.ones((2, len(rows[0]))), np.full((1, len(rows[0])), 7.0)
    inputs[: len(rows)] = rows
    function.fill(inputs, out, slice(0, len(rows[0])))
    return out[0]


@pytest.mark.parametrize("width", widths())
@pytest.mark.parametrize("name", [name for name in FUNCTIONS if FUNCTIONS[name][2]])
def test_two_units_in_the_last_place(name: str, width: int):
    random = np.random.default_rng(3)
    size = 10.0 ** random.uniform(-12, 4, 301)
    x = np.where(np.arange(301) % 2, size, -size)
    y = random.uniform(-3, 3, 301)
    if name == "acos":
        x = np.concatenate([random.uniform(-1, 1, 200), [1.0, -1.0, 0.5, -0.5, 0.0, 1 - 1e-12]])
    if name == "sqrt":
        x = size
    rows = (x, y) if name in OF_TWO else (x,)
    found = computed(name, width, *rows)
    with mpmath.workdps(40):
        exact = FUNCTIONS[name][2]
        errors = [
            abs(mpmath.mpf(float(value)) - exact(*map(mpmath.mpf, map(float, given))))
            for value, *given in zip(found, *rows, strict=True)
        ]
    units = np.spacing(np.abs(FUNCTIONS[name][1](*rows)))
    assert max(float(error) / unit for error, unit in zip(errors, units, strict=True)) < 2.5


SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, np.nan, 1e-300, -1e-300, 1e150, -2.0]


@pytest.mark.parametrize("width", widths())
@pytest.mark.parametrize("name", FUNCTIONS)
def test_at_zero_and_without_a_value_as_numpy(name: str, width: int):
    x, y = (each.ravel() for each in np.meshgrid(SPECIAL, SPECIAL))
    if name in ("sin", "cos"):
        x = np.where(np.abs(x) > 1e3, 1e3, x)
    rows = (x, y) if name in OF_TWO else (x,)
    with np.errstate(all="ignore"):
        expected = FUNCTIONS[name][1](*rows).astype(float)
    found = computed(name, width, *rows)
    np.testing.assert_allclose(found, expected, rtol=5e-16, atol=0)
    if name in ("atan2", "1/"):
        zero = expected == 0
        assert np.array_equal(np.signbit(found[zero]), np.signbit(expected[zero]))


def test_angles_without_digits_have_no_sine():
    """Rounding alone decides where an angle of 1e12 rad points."""
    angles = np.array([1e12, -1e300, np.inf, 3.0])
    assert np.isnan(computed("sin", widths()[-1], angles)[:3]).all()
    assert np.isnan(computed("cos", widths()[-1], angles)[:3]).all()


def test_rows_at_any_places_and_a_part_of_the_poses():
    """Results may be planes of arrays of their own; poses before and after the part stay."""
    record = Record({"x": [0.3], "y": [0.6]})
    x, y = record.input("x"), record.input("y")
    processor = this_processor()
    assert processor is not None
    function = VectorFunction.of(Program.of(record, [x * y, x - y]), processor)
    inputs = np.random.default_rng(0).uniform(1, 2, (2, 100))
    products, differences = np.zeros((2, 3, 100)), np.zeros(100)
    function.fill(inputs, [products[1, 2], differences], slice(7, 50))
    part = inputs[:, 7:50]
    np.testing.assert_allclose(products[1, 2, 7:50], part[0] * part[1], rtol=1e-15)
    np.testing.assert_allclose(differences[7:50], part[0] - part[1], rtol=1e-14)
    assert np.count_nonzero(products) == np.count_nonzero(differences) == 43


@pytest.mark.parametrize("width", widths())
@pytest.mark.parametrize(
    ("part", "count", "steps"),
    [(None, 9, 400), (75, 1, 400), (75, 9, 400), (75, 100, 400), (75, 100, 8000)],
)
def test_a_long_program_is_the_same_in_parts(width: int, part: int | None, count: int, steps: int):
    """Each operation works on any of those before it, so that many values are handed on.

    The parts of the longest are functions, and made quickly.
    """
    random = np.random.default_rng(11)
    record = Record({"x": [0.3, 0.6], "y": [0.7, 0.2]})
    entries = [record.input("x"), record.input("y")]
    for _ in range(steps):
        a, b = (entries[k] for k in random.integers(len(entries), size=2))
        shifted = 1.5 + 0.1 * sine(a)
        made = (sine(a) - cosine(a), square_root(shifted), 1 / square_root(shifted), 0.5 * (a - b))
        entries.append(made[random.integers(4)])
    program = Program.of(record, [*entries[::7], entries[-1], 2.0])
    assert (program.operations > 6000) == (steps == 8000)
    inputs = random.uniform(0.1, 0.9, (2, count))
    out = np.empty((len(program.outputs), count))
    processor = this_processor()
    assert processor is not None
    function = VectorFunction.of(program, replace(processor, width=width, part=part))
    function.fill(inputs, out, slice(0, count))
    expected = program.evaluate({"x": inputs[0], "y": inputs[1]})
    for row, values in zip(out, expected, strict=True):
        np.testing.assert_allclose(row, np.broadcast_to(values, count), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("width", widths())
def test_a_root_and_its_reciprocal(width: int):
    """They have steps in common, down to the smallest numbers and at zero."""
    record = Record({"x": [0.3, 0.6]})
    root = square_root(record.input("x"))
    processor = this_processor()
    assert processor is not None
    program = Program.of(record, [root, 1 / root])
    function = VectorFunction.of(program, replace(processor, width=width))
    x = np.array([[0.0, 1e-300, 1e-30, 0.25, 2.0, 1e30, 1e300, -1.0, np.nan]])
    out = np.empty((2, x.size))
    function.fill(x, out, slice(0, x.size))
    with np.errstate(all="ignore"):
        expected = np.sqrt(x[0]), 1 / np.sqrt(x[0])
    np.testing.assert_allclose(out, expected, rtol=5e-16)


def test_tests_that_are_multiplied_are_joined():
    """A product of comparisons is 1 where all of them hold, and 0 where one has no number."""
    record = Record({"x": [0.3], "y": [0.6]})
    x, y = record.input("x"), record.input("y")
    entries = [greater(x, 0) * greater(y, 0), greater(x, 0) * y, 4 * (1 - greater(x, y))]
    processor = this_processor()
    assert processor is not None
    function = VectorFunction.of(Program.of(record, entries), processor)
    inputs = np.array([each.ravel() for each in np.meshgrid([-1.0, 2.0, np.nan], [-3.0, 1.0])])
    out = np.empty((3, 6))
    function.fill(inputs, out, slice(0, 6))
    with np.errstate(invalid="ignore"):
        a, b = inputs
        expected = [(a > 0) & (b > 0), (a > 0) * b, 4.0 * (1.0 - (a > b))]
    np.testing.assert_array_equal(out, np.array(expected, dtype=float))
