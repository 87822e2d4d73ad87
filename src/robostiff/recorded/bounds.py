"""What an entry cannot fall below, told from its operations alone."""

from __future__ import annotations

import math

from robostiff.record import Operation, Record


def lower_bound(record: Record, step: int) -> float:
    """A number that a step never falls below; minus infinity where its operations do not tell.

    Examples
    --------
    >>> record = Record({"x": [3.0]})
    >>> x = record.input("x")
    >>> lower_bound(record, (x * x * 2 + 1).step), lower_bound(record, x.step)
    (1.0, -inf)
    """
    operation, a, b = record.operations[step]
    match operation:
        case Operation.NUMBER:
            return float(a)
        case Operation.SQUARE_ROOT:
            return 0.0
        case Operation.ADD:
            return lower_bound(record, a) + lower_bound(record, b)
        case Operation.MULTIPLY if a == b:
            return 0.0
        case Operation.MULTIPLY:
            bounds = lower_bound(record, a), lower_bound(record, b)
            return bounds[0] * bounds[1] if min(bounds) >= 0 else -math.inf
        case _:
            return -math.inf
