"""Identities decided at random points in ball arithmetic, and steps without what they repeat."""

import numpy as np
import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Steps
from robostiff.analytic.exact.exact_points import ExactPoints, values_of
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


@pytest.mark.parametrize("name", ["h4", "hexapod", "delta", "3-rps"])
def test_no_definition_is_zero_or_a_copy_and_zeros_are_zeros(name):
    robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
    derivation = rs.derive(robot, form=Steps())
    random = np.random.default_rng(5)
    names = [d.symbol for d in derivation.definitions]
    found = []
    for _ in range(2):
        known = {k: v * random.uniform(0.98, 1.02) for k, v in robot.nominal.items()}
        values = {s: known[s.name] for s in derivation.symbols}
        entries = list(derivation.K)
        found.append(values_of([*names, *entries], values, derivation.definitions, careful=True))
    of_names = np.array([x[: len(names)] for x in found])
    of_K = np.array([x[len(names) :] for x in found]).reshape(2, *derivation.K.shape)
    assert np.all(np.max(np.abs(of_names), axis=0) > 0)
    for i in range(len(names)):
        for sign in (1, -1):
            others = np.delete(of_names, i, axis=1)
            assert np.min(np.max(np.abs(1 - sign * others / of_names[:, [i]]), axis=0)) > 1e-14
    K = derivation.K
    size = np.sqrt(np.abs(np.einsum("kii->ki", of_K)))
    for i, j in np.ndindex(K.shape):
        is_zero = np.all(np.abs(of_K[:, i, j]) <= 1e-12 * size[:, i] * size[:, j])
        assert (K[i, j] == 0) == is_zero
    for a in set(K):
        for b in set(K) - {a}:
            places = [K.tolist().index(next(r for r in K.tolist() if x in r)) for x in (a, b)]
            columns = [K.tolist()[p].index(x) for p, x in zip(places, (a, b), strict=True)]
            own, other = (of_K[:, p, c] for p, c in zip(places, columns, strict=True))
            assert np.max(np.abs(own - other)) > 1e-12 * np.max(np.abs(own))


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
