"""Derivatives of records against complex steps and central differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from robostiff import InputError
from robostiff.record import (
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
        seen |= {record.operations[step][0] for step in record.needed([entry.step])}
    assert seen == set(Operation)


def test_second_derivative():
    record = Record({"x": [0.4]})
    x = record.input("x")
    (first,) = derivatives_along(record, [sine(x) * x], {"x": 1})
    (second,) = derivatives_along(record, [first], {"x": 1})
    assert second.sample == pytest.approx(2 * np.cos(0.4) - 0.4 * np.sin(0.4))


def test_unknown_input():
    record = Record({"x": [0.4]})
    with pytest.raises(InputError, match="derivative"):
        derivatives_along(record, [record.input("x")], {"z": 1})
