"""Names that a reader would not give, and products that a person writes shorter."""

import sympy as sp

from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.record import Record, cosine, square_root

a, b, t = (sp.Symbol(name, positive=True) for name in "abt")


def reading() -> tuple[NamedReading, list]:
    record = Record({"a": [3.0, 4.0, 3.5], "b": [1.0, 1.5, 1.2], "t": [0.3, 0.4, 0.7]})
    return NamedReading(record, {"a": a, "b": b, "t": t}), [record.input(x) for x in "abt"]


def test_a_multiple_of_a_symbol_needs_no_name():
    read, (x, _, _) = reading()
    assert read.length(square_root(2 * x * x)) == sp.sqrt(2) * a
    assert read.definitions == []


def test_other_lengths_have_one():
    read, (x, y, _) = reading()
    name = read.length(square_root(x * x + y * y))
    assert [(d.symbol, d.expression) for d in read.definitions] == [(name, sp.sqrt(a**2 + b**2))]


def test_a_difference_of_squares_is_one_root():
    read, (x, y, _) = reading()
    read.length(square_root(x * x - y * y))
    assert str(read.definitions[0].expression) == "sqrt(a**2 - b**2)"


def test_what_is_left_of_one_by_a_cosine_is_a_sine():
    read, (x, _, angle) = reading()
    c = cosine(angle)
    assert read(x * (1 - c * c)) == a * sp.sin(t) ** 2
    assert read(x / (1 - c * c)) == a / sp.sin(t) ** 2
    assert read(x * (1 - c)) == -a * (sp.cos(t) - 1)
