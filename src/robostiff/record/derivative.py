"""Derivatives of recorded formulas with respect to their inputs, recorded themselves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from robostiff.errors import InputError
from robostiff.record.entry import Entry, is_zero
from robostiff.record.functions import cosine, greater, sine, square_root
from robostiff.record.record import Operation, Record


def derivatives(record: Record, outputs: Sequence[Any], name: str) -> list[Any]:
    """Derivative of entries with respect to one input, by the chain rule step by step.

    Parameters
    ----------
    record : Record
    outputs : sequence of Entry or number
    name : str
        Of the input.

    Returns
    -------
    list of Entry or number
        One for each output, in the same record.

    Raises
    ------
    InputError
        When the record has no such input.

    Examples
    --------
    >>> record = Record({"x": [3.0]})
    >>> x = record.input("x")
    >>> derivatives(record, [x * x / 2, 7.0], "x")[0].sample
    array([3.])
    """
    return derivatives_along(record, outputs, {name: 1})


def derivatives_along(
    record: Record, outputs: Sequence[Any], direction: Mapping[str, Any]
) -> list[Any]:
    """Rate of entries when some inputs change at rates of their own, entries or numbers.

    Examples
    --------
    >>> record = Record({"x": [3.0], "y": [2.0], "dy": [0.5]})
    >>> x, y = record.input("x"), record.input("y")
    >>> derivatives_along(record, [x * y], {"x": 1, "y": record.input("dy")})[0].sample
    array([3.5])
    """
    for name in direction:
        if name not in record.inputs:
            raise InputError("derivative", got=name, expected=", ".join(record.inputs))
    rates: dict[int, Any] = {record.input(name).step: rate for name, rate in direction.items()}
    steps = [x.step for x in outputs if isinstance(x, Entry)]
    for step in record.needed(steps):
        if step not in rates:
            rates[step] = _rate(record, step, rates)
    return [rates[x.step] if isinstance(x, Entry) else 0 for x in outputs]


def _rate(record: Record, step: int, rates: dict[int, Any]) -> Any:
    operation, first, second = record.operations[step]
    if operation not in _OF_ONE and operation not in _OF_TWO:
        return 0  # a number; or a comparison, which jumps and is flat elsewhere
    a, da = record.at(first), rates[first]
    if second is None:
        return 0 if is_zero(da) else _OF_ONE[operation](a, Entry(record, step)) * da
    b, db = record.at(second), rates[second]
    return _OF_TWO[operation](a, da, b, db)


def _of_least(a: Any, da: Any, b: Any, db: Any) -> Any:
    first_is_less = greater(b, a)
    return first_is_less * da + (1 - first_is_less) * db


#: Slope of a function of a, whose value is y.
_OF_ONE: dict[Operation, Callable[[Any, Entry], Any]] = {
    Operation.NEGATE: lambda a, y: -1,
    Operation.RECIPROCAL: lambda a, y: -(y * y),
    Operation.SQUARE_ROOT: lambda a, y: y.reciprocal() * 0.5,
    Operation.SINE: lambda a, y: cosine(a),
    Operation.COSINE: lambda a, y: -sine(a),
    Operation.ARC_COSINE: lambda a, y: -square_root(1 - a * a).reciprocal(),
}

#: Rate of a function of a and b from theirs.
_OF_TWO: dict[Operation, Callable[[Any, Any, Any, Any], Any]] = {
    Operation.ADD: lambda a, da, b, db: da + db,
    Operation.SUBTRACT: lambda a, da, b, db: da - db,
    Operation.MULTIPLY: lambda a, da, b, db: da * b + a * db,
    Operation.ARC_TANGENT: lambda a, da, b, db: (da * b - a * db) / (a * a + b * b),
    Operation.LEAST: _of_least,
}
