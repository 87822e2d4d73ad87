"""Functions of entries and numbers, also entry by entry over arrays of objects."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.record.exact import entry_by_entry, exact_root, exact_value, is_exact
from robostiff.record.record import OPERATORS, Entry, Operation, Record, is_zero, step_of


@entry_by_entry
def square_root(x: Any) -> Any:
    """Square root of an entry, a number, or each entry of an array."""
    if not isinstance(x, Entry):
        return exact_root(x) if is_exact(x) else math.sqrt(x)
    operation, a, b = x.record.operation(x.step)
    if operation is Operation.MULTIPLY and a == b:  # known where its sign is, at all samples alike
        root = Entry(x.record, a)
        sample = root.sample.tolist()
        if sample and all(value > 0 for value in sample):
            return root
        if sample and all(value < 0 for value in sample):
            return -root
    return x.apply(Operation.SQUARE_ROOT)


@entry_by_entry
def sine(x: Any) -> Any:
    """Sine of an angle [rad]; that of zero is a whole number, which keeps formulas exact."""
    return _of_turn(x, 0, Operation.SINE, math.sin)


@entry_by_entry
def cosine(x: Any) -> Any:
    """Cosine of an angle [rad]; that of zero is a whole number, which keeps formulas exact."""
    return _of_turn(x, 1, Operation.COSINE, math.cos)


def _of_turn(x: Any, at_zero: int, operation: Operation, function: Callable[..., float]) -> Any:
    """Sine or cosine: what it is at zero is also its place in the turns of a record."""
    if isinstance(x, Entry):
        last, a, _ = x.record.operation(x.step)
        if last is Operation.NEGATE:
            found = _of_turn(Entry(x.record, a), at_zero, operation, function)
            return found if at_zero else -found
        known = x.record.turns.get(x.step)
        return x.apply(operation) if known is None else known[at_zero]
    if is_exact(x):
        return exact_value(operation.value, x)
    return at_zero if x == 0 else function(x)


@entry_by_entry
def arc_cosine(x: Any) -> Any:
    """Angle in 0 to pi of a cosine [rad]."""
    if isinstance(x, Entry):
        return x.apply(Operation.ARC_COSINE)
    return exact_value("acos", x) if is_exact(x) else math.acos(x)


@entry_by_entry
def hyperbolic_tangent(x: Any) -> Any:
    """Of an entry or number."""
    if isinstance(x, Entry):
        return x.apply(Operation.HYPERBOLIC_TANGENT)
    return exact_value("tanh", x) if is_exact(x) else math.tanh(x)


@entry_by_entry
def reciprocal(x: Any) -> Any:
    """1 / x."""
    return x.reciprocal() if isinstance(x, Entry) else 1 / x


def arc_tangent(sine_: Any, cosine_: Any) -> Any:
    """Angle of a point (cosine, sine) of any radius, -pi to pi [rad]; of arrays of floats, too."""
    if isinstance(sine_, np.ndarray):
        return np.arctan2(sine_, cosine_)
    return _of_two(Operation.ARC_TANGENT, sine_, cosine_, math.atan2)


def angle_of(sine_: Any, cosine_: Any, near: float = 0.0) -> Any:
    """Angle of a known sine and cosine, within half a turn of another angle [rad].

    Its own sine and cosine are these two: they leave no operations in the record.
    """
    s, c = sine(near), cosine(near)
    found = near + arc_tangent(sine_ * c - cosine_ * s, cosine_ * c + sine_ * s)
    return with_turn(found, sine_, cosine_)


def with_turn(angle: Any, sine_: Any, cosine_: Any) -> Any:
    """The same angle, whose sine and cosine the record has."""
    if isinstance(angle, Entry):
        angle.record.turns[angle.step] = sine_, cosine_
    return angle


def least(a: Any, b: Any) -> Any:
    """The smaller one of two."""
    return _of_two(Operation.LEAST, a, b, min)


def greater(a: Any, b: Any) -> Any:
    """1 where a > b, else 0."""
    return _of_two(Operation.GREATER, a, b, lambda x, y: int(bool(x > y)))


def _of_two(operation: Operation, a: Any, b: Any, of_numbers: Callable[[Any, Any], Any]) -> Any:
    record = next((x.record for x in (a, b) if isinstance(x, Entry)), None)
    if record is None:
        return of_numbers(a, b)
    return Entry(record, record.step(operation, step_of(record, a), step_of(record, b)))


def plain_root(x: Any) -> Any:
    """sqrt(x) whatever stands below it: the sign of a root at few samples says too little."""
    return x.apply(Operation.SQUARE_ROOT) if isinstance(x, Entry) else math.sqrt(x)


#: The operations on entries and floats, with which a program is written into another record.
ENTRY_FUNCTIONS: dict[Operation, Callable[..., Any]] = {
    **OPERATORS,
    Operation.RECIPROCAL: reciprocal,
    Operation.SQUARE_ROOT: plain_root,
    Operation.SINE: sine,
    Operation.COSINE: cosine,
    Operation.ARC_COSINE: arc_cosine,
    Operation.ARC_TANGENT: arc_tangent,
    Operation.HYPERBOLIC_TANGENT: hyperbolic_tangent,
    Operation.LEAST: least,
    Operation.GREATER: greater,
}


def usual_size(value: Any) -> float:
    """Mean size of an entry over the samples, or the size of a number."""
    return float(np.mean(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def most_size(value: Any) -> float:
    """Largest size of an entry over the samples, or the size of a number."""
    return float(np.max(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def least_size(value: Any) -> float:
    """Smallest size of an entry over the samples, or the size of a number."""
    return float(np.min(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def as_part(value: Any) -> Any:
    """An entry against its mean size over the samples; a number as it is."""
    return value * (1 / usual_size(value)) if isinstance(value, Entry) else value


def derivatives_along(
    record: Record, outputs: Sequence[Any], direction: Mapping[str, Any]
) -> list[Any]:
    """Rate of entries when some inputs change at rates of their own, entries or numbers.

    InputError when the record has no such input.
    """
    for name in direction:
        if name not in record.inputs:
            raise InputError("derivative", got=name, expected=", ".join(record.inputs))
    rates: dict[int, Any] = {record.input(name).step: rate for name, rate in direction.items()}
    steps = [x.step for x in outputs if isinstance(x, Entry)]
    for step in record.steps_needed(steps):
        operation, first, second = record.operation(step)
        if step in rates:
            continue
        if operation not in _OF_ONE and operation not in _OF_TWO:
            rates[step] = 0  # a number; or a comparison, which jumps and is flat elsewhere
        elif second is not None:
            a, b = record.at(first), record.at(second)
            rates[step] = _OF_TWO[operation](a, rates[first], b, rates[second])
        elif is_zero(rates[first]):
            rates[step] = 0
        else:
            slope = _OF_ONE[operation](record.at(first), Entry(record, step))
            rates[step] = slope * rates[first]
    return [rates[x.step] if isinstance(x, Entry) else 0 for x in outputs]


def gradient(record: Record, output: Any, names: Sequence[str]) -> list[Any]:
    """Rates of one entry with several inputs, by one sweep from the entry back to the inputs.

    It takes some three times as many operations as the entry, however many inputs there are.

    InputError when the record has no such input.
    """
    for name in names:
        if name not in record.inputs:
            raise InputError("gradient", got=name, expected=", ".join(record.inputs))
    rates: dict[int, Any] = {}  # of the output with each step
    steps: list[int] = []
    if isinstance(output, Entry):
        rates[output.step] = 1
        steps = list(record.steps_needed([output.step]))
    for step in reversed(steps):
        operation, first, second = record.operation(step)
        rate = rates.get(step, 0)
        if is_zero(rate) or (operation not in _OF_ONE and operation not in _OF_TWO):
            continue
        a = record.at(first)
        if second is None:
            found = ((first, _OF_ONE[operation](a, Entry(record, step)) * rate),)
        else:
            of, b = _OF_TWO[operation], record.at(second)
            found = ((first, of(a, rate, b, 0)), (second, of(a, 0, b, rate)))
        for argument, part in found:
            rates[argument] = rates[argument] + part if argument in rates else part
    return [rates.get(record.input(name).step, 0) for name in names]


#: Slope of a function of a, whose value is y.
_OF_ONE: dict[Operation, Callable[[Any, Entry], Any]] = {
    Operation.NEGATE: lambda a, y: -1,
    Operation.RECIPROCAL: lambda a, y: -(y * y),
    Operation.SQUARE_ROOT: lambda a, y: y.reciprocal() * 0.5,
    Operation.SINE: lambda a, y: cosine(a),
    Operation.COSINE: lambda a, y: -sine(a),
    Operation.ARC_COSINE: lambda a, y: -square_root(1 - a * a).reciprocal(),
    Operation.HYPERBOLIC_TANGENT: lambda a, y: 1 - y * y,
}

#: Rate of a function of a and b from theirs.
_OF_TWO: dict[Operation, Callable[[Any, Any, Any, Any], Any]] = {
    Operation.ADD: lambda a, da, b, db: da + db,
    Operation.SUBTRACT: lambda a, da, b, db: da - db,
    Operation.MULTIPLY: lambda a, da, b, db: da * b + a * db,
    Operation.ARC_TANGENT: lambda a, da, b, db: (da * b - a * db) / (a * a + b * b),
    Operation.LEAST: lambda a, da, b, db: greater(b, a) * da + (1 - greater(b, a)) * db,
}
