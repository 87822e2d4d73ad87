"""Identities decided at random points in ball arithmetic, and steps without what they repeat."""

import sympy as sp

from robostiff.analytic.exact.exact_points import ExactPoints
from robostiff.analytic.reading.record_reading import StepReading
from robostiff.record import Record, cosine, sine, square_root


def record_of(*values):
    record = Record(dict(zip("xy", values, strict=False)))
    return record, [record.input(name) for name in record.inputs]


def test_what_is_equal_is_the_first_of_its_kind():
    record, (x, y) = record_of([0.7, 1.9], [0.4, 0.8])
    square = (x + y) * (x + y)
    expanded = x * x + 2 * x * y + y * y
    steps = [x.step, y.step, square.step, expanded.step, (y * y - x * x).step]
    same = ExactPoints(record).same([*steps, ((x - y) * (x + y)).step])
    assert same[expanded.step].step == square.step
    last = same[((x - y) * (x + y)).step]
    assert (last.step, last.factor) == ((y * y - x * x).step, -1)


def test_floats_that_agree_to_12_digits_are_not_equal():
    record, (x,) = record_of([0.7, 1.9])
    one = cosine(x) * cosine(x) + sine(x) * sine(x)
    near = x * (one + sp.Rational(1, 10**20))
    same = ExactPoints(record).same([x.step, one.step, near.step])
    assert same[one.step].step is None
    assert same[one.step].factor == 1
    assert same[near.step].step == near.step


def test_roots_of_numbers_are_no_floats():
    record, (x,) = record_of([0.7, 1.9])
    difference = x * sp.sqrt(3) * sp.sqrt(2) - x * sp.sqrt(6)
    zero = square_root(x * x + 1) * square_root(x * x + 1) - (x * x + 1)
    assert (
        difference == 0 or ExactPoints(record).same([difference.step])[difference.step].factor == 0
    )
    assert zero == 0 or ExactPoints(record).same([zero.step])[zero.step].factor == 0


def test_steps_are_written_by_sums_of_angles_and_products_of_inputs():
    record = Record({"a": [0.7, 1.9], "b": [0.4, -0.8], "l": [1.3, 0.6]})
    a, b, length = map(record.input, "abl")
    both = cosine(a) * cosine(b) - sine(a) * sine(b), sine(a) * cosine(b) - cosine(a) * sine(b)
    # l sin(b), written by the angles a and a + b
    lever = length * cosine(a) * (sine(a) * cosine(b) + cosine(a) * sine(b))
    lever = lever - length * sine(a) * both[0]
    symbols = dict(zip("abl", sp.symbols("a b l", real=True), strict=True))
    reading = StepReading(record, symbols, [*both, lever, sine(b)])
    found = [reading(x) for x in (*both, lever)]
    for d in reversed(reading.definitions):
        found = [x.xreplace({d.symbol: d.expression}) for x in found]
    x, y, z = symbols.values()
    assert found[:2] == [sp.cos(x + y), sp.sin(x - y)]
    assert found[2] == z * sp.sin(y)


def test_a_reciprocal_needs_no_name():
    record = Record({"x": [3.0, 5.0], "y": [2.0, 7.0]})
    x, y = record.input("x"), record.input("y")
    below = 1 / (x + 1)
    reading = StepReading(
        record, {"x": sp.Symbol("x"), "y": sp.Symbol("y")}, [x * below, y * below]
    )
    (only,) = reading.definitions
    assert only.expression == sp.Symbol("x") + 1
    assert reading(y * below) == sp.Symbol("y") / only.symbol
