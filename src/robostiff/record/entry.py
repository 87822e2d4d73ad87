"""An entry of an array that records the operations on it."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.record.record import Operation, Record

#: Numbers that a formula may hold beside entries: floats, or exact SymPy numbers.
Number = Any


class Entry:
    """A symbolic value: a step of a record.

    Entries add, multiply and divide with one another and with numbers, alone and within NumPy
    arrays of objects. Zeros and ones leave no trace: ``0 * x`` is the number 0, ``1 * x`` is x.

    Attributes
    ----------
    record : Record
    step : int
        Which step of the record.

    Examples
    --------
    >>> x = Record({"x": [3.0]}).input("x")
    >>> 0 * x + x * 1 - x
    0
    >>> (np.array([x, 2], dtype=object) @ np.array([x, x], dtype=object)).sample
    array([15.])
    """

    __slots__ = ("record", "step")

    # SymPy's numbers leave the operation to entries, and do not try to convert them.
    _op_priority = 20.0

    def __init__(self, record: Record, step: int) -> None:
        self.record = record
        self.step = step

    @property
    def sample(self) -> np.ndarray:
        """Its value at the sample points (samples,)."""
        return self.record.sample(self.step)

    @property
    def free_symbols(self) -> frozenset[str]:
        """Inputs of its record, as a sign that it is a formula."""
        return frozenset(self.record.inputs)

    def named(self, name: str) -> Entry:
        """The same entry with a name for readers of the record."""
        if self._operation()[0] is not Operation.INPUT:
            self.record.names.setdefault(self.step, name)
        return self

    def apply(self, operation: Operation, other: Any = None) -> Entry:
        """A function of this entry, or of it and another or a number."""
        b = None if other is None else step_of(self.record, other)
        return Entry(self.record, self.record.step(operation, self.step, b))

    def __add__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        if is_zero(other):
            return self
        if isinstance(other, Entry):
            if (minus := other._negated()) is not None:
                return self - minus
            if (minus := self._negated()) is not None:
                return other - minus
        return self.apply(Operation.ADD, other)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        if is_zero(other):
            return self
        if isinstance(other, Entry):
            if other.step == self.step:
                return 0
            if (minus := other._negated()) is not None:
                return self + minus
            if (minus := self._negated()) is not None:
                return -(minus + other)
        return self.apply(Operation.SUBTRACT, other)

    def __rsub__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        if is_zero(other):
            return -self
        if (minus := self._negated()) is not None:
            return minus + other
        return Entry(
            self.record,
            self.record.step(Operation.SUBTRACT, step_of(self.record, other), self.step),
        )

    def __mul__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        if not isinstance(other, Entry):
            return self._times(other)
        if (minus := self._negated()) is not None:
            return -(minus * other)
        if (minus := other._negated()) is not None:
            return -(self * minus)
        if self.step == other.step:
            operation, a, _ = self._operation()
            if operation is Operation.SQUARE_ROOT:
                return Entry(self.record, a)
        return self.apply(Operation.MULTIPLY, other)

    __rmul__ = __mul__

    def __neg__(self) -> Entry:
        minus = self._negated()
        if minus is not None:
            return minus
        operation, a, b = self._operation()
        if operation is Operation.SUBTRACT:
            return Entry(self.record, self.record.step(operation, b, a))
        return self.apply(Operation.NEGATE)

    def __truediv__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        if not isinstance(other, Entry):
            return self._times(1 / other)
        if other.step == self.step:
            return 1
        return self * other.reciprocal()

    def __rtruediv__(self, other: Any) -> Any:
        if not _combines(other):
            return NotImplemented
        return other * self.reciprocal()

    def __pow__(self, power: int) -> Any:
        if not isinstance(power, int):
            raise InputError("power of an entry", got=power, expected="an integer")
        base = self if power >= 0 else self.reciprocal()
        result: Any = 1
        for bit in bin(abs(power))[2:]:
            result = result * result
            if bit == "1":
                result = result * base
        return result

    def reciprocal(self) -> Entry:
        """1 / self, computed once for all divisions by it."""
        operation, a, _ = self._operation()
        if operation is Operation.RECIPROCAL:
            return Entry(self.record, a)
        if (minus := self._negated()) is not None:
            return -minus.reciprocal()
        return self.apply(Operation.RECIPROCAL)

    def __repr__(self) -> str:
        return f"Entry({self.record.names.get(self.step, self.step)})"

    def _times(self, number: Number) -> Any:
        if is_zero(number):
            return 0
        if is_one(number):
            return self
        if is_one(-number):
            return -self
        operation, a, b = self._operation()
        if operation is Operation.MULTIPLY:
            for factor, rest in ((a, b), (b, a)):
                inner, value, _ = self.record.operations[factor]
                if inner is Operation.NUMBER:
                    return Entry(self.record, rest) * (number * value)
        if operation is Operation.NEGATE:
            return Entry(self.record, a) * -number
        return self.apply(Operation.MULTIPLY, number)

    def _operation(self) -> tuple[Operation, Any, Any]:
        return self.record.operations[self.step]

    def _negated(self) -> Entry | None:
        """The entry of which this one is the negative, if it is one."""
        operation, a, _ = self.record.operations[self.step]
        return Entry(self.record, a) if operation is Operation.NEGATE else None


def is_number(value: Any) -> bool:
    """Whether a value is a number rather than an entry of a record."""
    return not isinstance(value, Entry)


def is_zero(value: Any) -> bool:
    """Whether a value is the number 0."""
    return not isinstance(value, Entry) and bool(value == 0)


def is_one(value: Any) -> bool:
    """Whether a value is the number 1."""
    return not isinstance(value, Entry) and bool(value == 1)


def is_exact(value: Any) -> bool:
    """Whether a number is one of SymPy's, which stays as it is."""
    return hasattr(value, "is_number")


def step_of(record: Record, value: Any) -> int:
    """The step of a record that is an entry, or a number."""
    if isinstance(value, Entry):
        return value.step
    return record.number(value if is_exact(value) else float(value))


def _combines(other: Any) -> bool:
    """Whether it is an entry or a number; arrays do the arithmetic entry by entry themselves."""
    return not isinstance(other, np.ndarray | list | tuple)


def usual_size(value: Any) -> float:
    """Mean size of an entry over the samples, or the size of a number."""
    return float(np.mean(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def most_size(value: Any) -> float:
    """Largest size of an entry over the samples, or the size of a number."""
    return float(np.max(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))


def least_size(value: Any) -> float:
    """Smallest size of an entry over the samples, or the size of a number."""
    return float(np.min(np.abs(value.sample))) if isinstance(value, Entry) else abs(float(value))
