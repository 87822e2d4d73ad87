"""Identities decided at random points in ball arithmetic, and steps without what they repeat."""

import sympy as sp

from robostiff.analytic.exact.exact_points import ExactPoints
from robostiff.record import Record, cosine, sine


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
