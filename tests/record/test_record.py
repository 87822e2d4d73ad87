"""Records: equal operations once, identities found by value, derivatives against differences."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from robostiff import InputError
from robostiff.record import (
    Entry,
    Operation,
    Program,
    Record,
    arc_cosine,
    arc_tangent,
    cosine,
    derivatives_along,
    greater,
    hyperbolic_tangent,
    least,
    reciprocal,
    sine,
    square_root,
)


@pytest.fixture
def record() -> Record:
    return Record({"x": [0.3, 0.7], "y": [1.1, 0.4]})


def inputs(record: Record) -> tuple[Entry, Entry]:
    return record.input("x"), record.input("y")


def test_equal_operations_are_written_once(record: Record):
    x, y = inputs(record)
    assert (x * y).step == (y * x).step
    assert (x + y).step == (y + x).step
    assert (x - y).step != (y - x).step
    assert least(x, y).step == least(y, x).step
    size = record.size
    _ = sine(x) * sine(x) + y * x
    after = record.size
    _ = sine(x) * sine(x) + y * x
    assert after > size
    assert record.size == after


def test_zeros_and_ones_leave_no_trace(record: Record):
    x, y = inputs(record)
    size = record.size
    for nothing in (0 * x, x - x, x * 0.0, 0 * (x / 1)):
        assert nothing == 0
        assert not isinstance(nothing, Entry)
    for same in (x + 0, 0 + x, x - 0, 1 * x, x * 1.0, x / 1, x**1):
        assert same.step == x.step
    assert x / x == 1
    assert x**0 == 1
    assert record.size == size
    minus = -x
    assert (-minus).step == x.step
    assert (-(x - y)).step == (y - x).step
    assert (1 / (1 / x)).step == x.step


def test_signs_travel_outwards(record: Record):
    x, y = inputs(record)
    assert ((-x) * y).step == (-(x * y)).step
    assert ((-x) * (-y)).step == (x * y).step
    assert (x + -y).step == (x - y).step
    assert (x - -y).step == (x + y).step
    assert (-x - y).step == (-(x + y)).step
    assert (1 / -x).step == (-(1 / x)).step
    assert sine(-x).step == (-sine(x)).step
    assert cosine(-x).step == cosine(x).step


def test_roots_of_squares(record: Record):
    x, _ = inputs(record)
    assert square_root(x * x).step == x.step
    assert square_root((-x) * (-x)).step == x.step
    below = x - 1
    assert np.allclose(square_root(below * below).sample, 1 - x.sample)
    mixed = x - 0.5  # of either sign at the samples
    assert np.allclose(square_root(mixed * mixed).sample, np.abs(mixed.sample))
    root = square_root(x)
    assert (root * root).step == x.step


def test_powers(record: Record):
    x, _ = inputs(record)
    for n in (-3, -1, 2, 5):
        assert np.allclose((x**n).sample, x.sample**n)
    with pytest.raises(InputError, match="power of an entry"):
        pow(x, 0.5)  # type: ignore[operator]


def test_samples_follow_numpy(record: Record):
    x, y = inputs(record)
    a, b = x.sample, y.sample
    pairs = [
        (x + y, a + b),
        (2 - x, 2 - a),
        (x / y, a / b),
        (3 / y, 3 / b),
        (square_root(x), np.sqrt(a)),
        (arc_cosine(x), np.arccos(a)),
        (arc_tangent(x, -y), np.arctan2(a, -b)),
        (least(x, 0.5), np.minimum(a, 0.5)),
        (greater(x, y), a > b),
        (reciprocal(x), 1 / a),
    ]
    for entry, value in pairs:
        assert np.allclose(entry.sample, value, rtol=1e-15)


def test_identities_are_found_by_value(record: Record):
    x, y = inputs(record)
    one = sine(x) * sine(x) + cosine(x) * cosine(x)
    assert record.simplified(one) == 1
    assert record.simplified(-one) == -1
    assert record.simplified(one - 1) == 0
    twice = sine(x) * cosine(x) * 2
    again = sine(x + x)
    assert record.simplified(again).step == twice.step
    assert record.simplified(-1 * again).sample == pytest.approx(-twice.sample)
    other = sine(x + y)
    assert record.simplified(other).step == other.step


def test_what_vanishes_is_judged_by_its_size(record: Record):
    x, _ = inputs(record)
    small = x * 1e-11
    assert record.simplified(small).step == small.step
    assert record.simplified(small, scale=100.0) == 0


def test_one_sample_that_agrees_is_not_enough():
    record = Record({"x": [0.5, 0.7]})
    x = record.input("x")
    again = x + x - 0.5  # equal to x at 0.5 only
    assert record.simplified(again).step == again.step


def test_only_needed_steps_are_in_a_program(record: Record):
    x, y = inputs(record)
    _ = cosine(y) + 1
    program = Program.of(record, [x * 2, 7])
    assert program.operations == 1
    assert program.inputs == ("x", "y")
    assert program.evaluated({"x": 3.0, "y": 0.0}) == [6.0, 7.0]


def test_nothing_is_decided_without_samples():
    record = Record({"x": ()})
    square = record.input("x") * record.input("x")
    assert record.simplified(square) is square
    assert square_root(square).apply(Operation.NEGATE).sample.size == 0
    assert record.operations[-2] is Operation.SQUARE_ROOT


def test_exact_numbers_become_floats_of_a_program():
    record = Record({"x": [2.0]})
    program = Program.of(record, [record.input("x") * sp.Rational(1, 3)])
    (number,) = program.steps.numbers.values()
    assert isinstance(number, float)


def test_names_are_for_readers_only(record: Record):
    x, y = inputs(record)
    size = (x * y).named("area")
    assert record.names == {size.step: "area"}
    assert x.named("other").step == x.step
    assert "x" not in record.names.values()


def test_what_is_tentative_is_forgotten():
    record = Record({"x": [0.3, 0.7], "y": [1.1, 0.4]})
    x, y = inputs(record)
    kept = x * y
    before = record.size
    with record.tentative():
        record.add_input("z", [5.0, 6.0])
        _ = (y * x + 1).named("n")
    assert record.size == before
    assert record.inputs == ("x", "y")
    assert not record.names
    # Nothing is found by value that is no longer there.
    again = (x * y + 1) * 2
    assert record.simplified(again).step == again.step
    assert (y * x).step == kept.step
    assert np.allclose(again.sample, 2 * (kept.sample + 1))


def test_roots_of_numbers_beyond_the_range_of_floats():
    small, large = 7**400, 3**710  # 339 digits each
    root = square_root(sp.Rational(large, small))
    assert root.is_Rational
    assert float(root) == pytest.approx(math.exp(355 * math.log(3) - 200 * math.log(7)), rel=1e-12)
    assert square_root(sp.Rational(10**40 * 4, 9)) == sp.Rational(2 * 10**20, 3)


AT = {"x": 0.37, "y": 0.81}

#: Analytic functions, which take complex numbers.
ANALYTIC: dict[str, Callable[[Any, Any], Any]] = {
    "sum": lambda x, y: x + y * 3,
    "difference": lambda x, y: y - x * x,
    "product": lambda x, y: x * y * x,
    "quotient": lambda x, y: x / (y + x),
    "negative": lambda x, y: -(x * y),
    "reciprocal": lambda x, y: reciprocal(x * y),
    "root": lambda x, y: square_root(x + y),
    "sine": lambda x, y: sine(x * y),
    "cosine": lambda x, y: cosine(x - y),
    "power": lambda x, y: (x + y) ** -3,
    "arc cosine": lambda x, y: arc_cosine(x * y),
    "hyperbolic tangent": lambda x, y: hyperbolic_tangent(x * y),
}
#: Others.
REAL: dict[str, Callable[[Any, Any], Any]] = {
    "arc tangent": lambda x, y: arc_tangent(x - y, x * y),
    "arc tangent behind": lambda x, y: arc_tangent(x, -y),
    "least": lambda x, y: least(x * x, y) * y,
    "least, the other": lambda x, y: least(y, x) * y,
    "greater": lambda x, y: greater(y, x) * x * y,
}


def recorded(function: Callable[[Any, Any], Any]) -> tuple[Record, Any]:
    record = Record({name: [value, value + 0.05] for name, value in AT.items()})
    return record, function(record.input("x"), record.input("y"))


def values(record: Record, entry: Any, **at: Any) -> Any:
    program = Program.of(record, [entry])
    return program.evaluated({**AT, **at})[0]


@pytest.mark.parametrize("name", ["x", "y"])
@pytest.mark.parametrize("function", ANALYTIC.values(), ids=ANALYTIC.keys())
def test_complex_step(function: Callable[[Any, Any], Any], name: str):
    record, entry = recorded(function)
    (rate,) = derivatives_along(record, [entry], {name: 1})
    step = 1e-30
    expected = np.imag(values(record, entry, **{name: np.complex128(AT[name] + 1j * step)})) / step
    assert values(record, rate) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("name", ["x", "y"])
@pytest.mark.parametrize("function", REAL.values(), ids=REAL.keys())
def test_central_difference(function: Callable[[Any, Any], Any], name: str):
    record, entry = recorded(function)
    (rate,) = derivatives_along(record, [entry], {name: 1})
    h = 1e-6
    above, below = (values(record, entry, **{name: AT[name] + s * h}) for s in (1, -1))
    assert values(record, rate) == pytest.approx((above - below) / (2 * h), rel=1e-7, abs=1e-9)


def test_every_operation_has_a_derivative_that_is_tested():
    seen = set()
    for function in (*ANALYTIC.values(), *REAL.values()):
        record, entry = recorded(function)
        seen |= {record.operations[step] for step in record.needed([entry.step])}
    assert seen == set(Operation)


def test_second_derivative():
    record = Record({"x": [0.4]})
    x = record.input("x")
    (first,) = derivatives_along(record, [sine(x) * x], {"x": 1})
    (second,) = derivatives_along(record, [first], {"x": 1})
    assert second.sample == pytest.approx(2 * np.cos(0.4) - 0.4 * np.sin(0.4))
