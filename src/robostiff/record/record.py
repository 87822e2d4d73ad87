"""A record, a list of operations in which equal ones occur once, and entries that record them."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Mapping, Set
from contextlib import contextmanager
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, NoAnswerError
from robostiff.record.exact import is_exact, shortened


class Operation(Enum):
    """Operation of a step of a record on its arguments."""

    INPUT = "input"
    NUMBER = "number"
    ADD = "+"
    SUBTRACT = "-"
    MULTIPLY = "*"
    NEGATE = "negate"
    RECIPROCAL = "1/"
    SQUARE_ROOT = "sqrt"
    SINE = "sin"
    COSINE = "cos"
    ARC_COSINE = "acos"
    ARC_TANGENT = "atan2"
    HYPERBOLIC_TANGENT = "tanh"
    LEAST = "min"
    GREATER = "greater"  # 1 where the first is greater than the second, else 0

    if not TYPE_CHECKING:
        __hash__ = object.__hash__  # that of enumerations takes as long as an operation


_DIGITS = 2**36
_SAME = 1e-12  # of a value: rounding at the samples

#: The operations on floats and arrays of them.
NUMPY_FUNCTIONS: dict[Operation, Any] = {
    Operation.ADD: np.add,
    Operation.SUBTRACT: np.subtract,
    Operation.MULTIPLY: np.multiply,
    Operation.NEGATE: np.negative,
    Operation.RECIPROCAL: np.reciprocal,
    Operation.SQUARE_ROOT: np.sqrt,
    Operation.SINE: np.sin,
    Operation.COSINE: np.cos,
    Operation.ARC_COSINE: np.arccos,
    Operation.ARC_TANGENT: np.arctan2,
    Operation.HYPERBOLIC_TANGENT: np.tanh,
    Operation.LEAST: np.minimum,
    Operation.GREATER: np.greater,
}

#: Operations of Python's operators, on values of any kind.
OPERATORS: dict[Operation, Any] = {
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
    Operation.MULTIPLY: operator.mul,
    Operation.NEGATE: operator.neg,
    Operation.RECIPROCAL: lambda a: 1 / a,
}

#: Rough costs of the operations, in additions.
COSTS = {
    **dict.fromkeys(Operation, 1),
    **dict.fromkeys((Operation.INPUT, Operation.NUMBER), 0),
    Operation.RECIPROCAL: 5,
    Operation.SQUARE_ROOT: 6,
    **dict.fromkeys((Operation.SINE, Operation.COSINE), 15),
    **dict.fromkeys((Operation.ARC_COSINE, Operation.ARC_TANGENT), 30),
    Operation.HYPERBOLIC_TANGENT: 30,
}


class Record:
    """Operations in the order in which they can be computed.

    Every step also carries its value at a few sample points. They distinguish a formula that is
    zero everywhere from one that is not, and which pivots are safe.

    Parameters
    ----------
    inputs : mapping of names to (samples,) arrays
        What the formulas depend on, with values at generic points; without any, where the formulas
        come from another record and nothing is to be decided.
    most : int, optional
        How many steps it may have. One more raises a `NoAnswerError`.
    """

    def __init__(self, inputs: Mapping[str, ArrayLike], most: int | None = None) -> None:
        samples = {name: np.array(values, dtype=float) for name, values in inputs.items()}
        shapes = {values.shape for values in samples.values()}
        if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
            raise InputError("samples of the inputs", expected="as many for each input")
        self.count = next(iter(shapes))[0] if shapes else 1
        self.inputs: tuple[str, ...] = tuple(samples)
        self.most: int | None = most
        # Columns and tuples of numbers, which the collector of garbage need not look at again.
        self.operations: list[Operation] = []
        self.a: list[Any] = []
        self.b: list[Any] = []
        self._samples: list[tuple[float, ...]] = []
        self.names: dict[int, str] = {}
        #: Sine and cosine of angles that come from them.
        self.turns: dict[int, tuple[Any, Any]] = {}
        self._known: dict[Operation, dict[Any, int]] = {operation: {} for operation in Operation}
        # By their leading digits, as far as they have been looked for.
        self._by_value: dict[int, list[int]] = {}
        self._ordered = 0
        self._hidden: set[int] = set()
        for name, values in samples.items():
            self._append(Operation.INPUT, name, None, tuple(values.tolist()))

    def sample(self, step: int) -> np.ndarray:
        """Value of a step at the sample points (samples,)."""
        return np.array(self._samples[step])

    @property
    def size(self) -> int:
        """Number of steps, inputs and numbers included."""
        return len(self.operations)

    def input(self, name: str) -> Entry:
        """The input of a name."""
        return Entry(self, self._known[Operation.INPUT][name, None])

    def hide(self, name: str) -> None:
        """Take no input of this name for another entry that has its values."""
        self._hidden.add(self.input(name).step)

    def add_input(self, name: str, sample: ArrayLike) -> Entry:
        """One more input, after those of before, with its values at the sample points.

        An input that exists already is returned as it is.
        """
        if name not in self.inputs:
            self.inputs = (*self.inputs, name)
            values = np.broadcast_to(np.asarray(sample, dtype=float), self.count)
            self._append(Operation.INPUT, name, None, tuple(values.tolist()))
        return self.input(name)

    @contextmanager
    def tentative(self) -> Iterator[None]:
        """Forget the steps, inputs and names that are added within; their entries are void then."""
        size, inputs, names = self.size, self.inputs, dict(self.names)
        try:
            yield
        finally:
            for step in range(self._ordered - 1, size - 1, -1):
                self._by_value[_leading_digits(self._samples[step][0])].pop()
            self._ordered = min(self._ordered, size)
            for step in range(size, self.size):
                operation, a, b = self.operation(step)
                self._known[operation].pop((a, b), None)  # the last may be half a step
            for column in (self.operations, self.a, self.b, self._samples):
                del column[size:]
            self.inputs, self.names = inputs, names
            self.turns = {step: turn for step, turn in self.turns.items() if step < size}

    def number(self, value: Any) -> int:
        """The step of a number."""
        known = self._known[Operation.NUMBER]
        if (value, None) not in known:
            self._append(Operation.NUMBER, value, None, (float(value),) * self.count)
        return known[value, None]

    def step(self, operation: Operation, a: int, b: int | None = None) -> int:
        """The step that does an operation on earlier ones, written once."""
        if b is not None and b < a and operation in _SYMMETRIC:
            a, b = b, a
        known = self._known[operation].get((a, b))
        if known is not None:
            return known
        if not self.count:
            return self._append(operation, a, b, ())
        samples = self._samples
        arguments = (samples[a],) if b is None else (samples[a], samples[b])
        # On a few floats quicker than NumPy, to the same bits; 1 / 0 would raise.
        if operation in OPERATORS and operation is not Operation.RECIPROCAL:
            return self._append(operation, a, b, tuple(map(OPERATORS[operation], *arguments)))
        with np.errstate(all="ignore"):
            value = NUMPY_FUNCTIONS[operation](*map(np.array, arguments))
        return self._append(operation, a, b, tuple(value.astype(float).tolist()))

    def simplify(self, value: Any, scale: float = 1.0) -> Any:
        """A simpler entry or number with the same value at all samples, if there is one.

        Identities such as cos^2 + sin^2 = 1 are found by value: two formulas that agree to 12
        digits at several generic points are taken for one.

        Parameters
        ----------
        scale : float
            Size against which a value counts as zero.
        """
        if not isinstance(value, Entry):
            short = shortened(value)
            return 0 if short is not value and abs(float(short)) <= _SAME * scale else short
        if not self.count:
            return value
        samples = self._samples[value.step]
        for number, near in ((0, _SAME * scale), (1, _SAME), (-1, _SAME)):
            if all(abs(x - number) <= near for x in samples):
                return number
        for step in range(self._ordered, value.step):
            digits = _leading_digits(self._samples[step][0])
            self._by_value.setdefault(digits, []).append(step)
        self._ordered = max(self._ordered, value.step)
        digits, near = _leading_digits(samples[0]), self._by_value.get
        for earlier in sorted([*near(digits - 1, ()), *near(digits, ()), *near(digits + 1, ())]):
            if earlier >= value.step:
                break
            if earlier in self._hidden:
                continue
            other = self._samples[earlier]  # the same up to one sign
            sign = 1.0 if other[0] * samples[0] > 0 else -1.0
            both = zip(other, samples, strict=True)
            if all(abs(y - sign * x) <= _SAME * abs(x) for y, x in both):
                return self.at(earlier) if sign > 0 else -self.at(earlier)
        return value

    def at(self, step: int) -> Any:
        """The entry of a step; a number stays a number."""
        is_number = self.operations[step] is Operation.NUMBER
        return self.a[step] if is_number else Entry(self, step)

    def operation(self, step: int) -> tuple[Operation, Any, Any]:
        """The operation of a step, and the steps on which it works; of an input its name."""
        return self.operations[step], self.a[step], self.b[step]

    def steps_needed(self, outputs: Iterable[int], known: Set[int] = frozenset()) -> list[int]:
        """The steps on which others depend, in order, themselves included, less known ones."""
        wanted = set(outputs) - known
        waiting = list(wanted)
        while waiting:
            for step in self.arguments(waiting.pop()):
                if step not in wanted and step not in known:
                    wanted.add(step)
                    waiting.append(step)
        return sorted(wanted)

    def arguments(self, step: int) -> tuple[int, ...]:
        """The steps on which a step works."""
        if self.operations[step] in _IDLE:
            return ()
        a, b = self.a[step], self.b[step]
        return (a,) if b is None else (a, b)

    def cost(self, outputs: Iterable[int]) -> int:
        """Cost of some steps, in additions."""
        return sum(COSTS[self.operations[step]] for step in self.steps_needed(outputs))

    def _append(self, operation: Operation, a: Any, b: Any, sample: tuple[float, ...]) -> int:
        step = len(self.operations)
        if step == self.most:
            raise NoAnswerError(f"a record of more than {self.most} operations")
        self._samples.append(sample)
        self.a.append(a)
        self.b.append(b)
        self.operations.append(operation)
        self._known[operation][a, b] = step
        return step


def _leading_digits(x: float) -> int:
    """Exponent and some ten digits of a size, to find steps of nearly the same value."""
    if not math.isfinite(x):
        return 0
    mantissa, exponent = math.frexp(abs(x))
    return 2 * _DIGITS * exponent + int(mantissa * _DIGITS)


_SYMMETRIC = {Operation.ADD, Operation.MULTIPLY, Operation.LEAST}
_IDLE = (Operation.INPUT, Operation.NUMBER)
# They do the arithmetic entry by entry themselves.
_ARRAYS = (np.ndarray, list, tuple)
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
    """

    __slots__ = ("record", "step")
    # SymPy's numbers leave the operation to entries, and do not try to convert them.
    _op_priority = 20.0

    def __init__(self, record: Record, step: int) -> None:
        self.record: Record = record
        self.step: int = step

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
        if self.record.operations[self.step] is not Operation.INPUT:
            self.record.names.setdefault(self.step, name)
        return self

    def apply(self, operation: Operation, other: Any = None) -> Entry:
        """A function of this entry, or of it and another or a number."""
        b = None if other is None else step_of(self.record, other)
        return Entry(self.record, self.record.step(operation, self.step, b))

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, Entry):
            if isinstance(other, _ARRAYS):
                return NotImplemented
            return self if other == 0 else self.apply(Operation.ADD, other)
        operations = self.record.operations
        if operations[other.step] is Operation.NEGATE:
            return self - -other
        if operations[self.step] is Operation.NEGATE:
            return other - -self
        return Entry(self.record, self.record.step(Operation.ADD, self.step, other.step))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if not isinstance(other, Entry):
            if isinstance(other, _ARRAYS):
                return NotImplemented
            return self if other == 0 else self.apply(Operation.SUBTRACT, other)
        if other.step == self.step:
            return 0
        operations = self.record.operations
        if operations[other.step] is Operation.NEGATE:
            return self + -other
        if operations[self.step] is Operation.NEGATE:
            return -(-self + other)
        return Entry(self.record, self.record.step(Operation.SUBTRACT, self.step, other.step))

    def __rsub__(self, other: Any) -> Any:
        if isinstance(other, _ARRAYS):
            return NotImplemented
        if other == 0:
            return -self
        if self.record.operations[self.step] is Operation.NEGATE:
            return -self + other
        step = self.record.step(Operation.SUBTRACT, step_of(self.record, other), self.step)
        return Entry(self.record, step)

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Entry):
            return NotImplemented if isinstance(other, _ARRAYS) else self._times(other)
        record, operations = self.record, self.record.operations
        operation = operations[self.step]
        if operation is Operation.NEGATE:
            return -(Entry(record, record.a[self.step]) * other)
        if operations[other.step] is Operation.NEGATE:
            return -(self * -other)
        if operation is Operation.SQUARE_ROOT and self.step == other.step:
            return Entry(record, record.a[self.step])
        return Entry(record, record.step(Operation.MULTIPLY, self.step, other.step))

    __rmul__ = __mul__

    def __neg__(self) -> Entry:
        record, step = self.record, self.step
        operation = record.operations[step]
        if operation is Operation.NEGATE:
            return Entry(record, record.a[step])
        if operation is Operation.SUBTRACT:
            return Entry(record, record.step(operation, record.b[step], record.a[step]))
        return Entry(record, record.step(Operation.NEGATE, step))

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, _ARRAYS):
            return NotImplemented
        if not isinstance(other, Entry):
            return self._times(1 / other)
        if other.step == self.step:
            return 1
        return self * other.reciprocal()

    def __rtruediv__(self, other: Any) -> Any:
        if isinstance(other, _ARRAYS):
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
        operation, a, _ = self.record.operation(self.step)
        if operation is Operation.RECIPROCAL:
            return Entry(self.record, a)
        if operation is Operation.NEGATE:
            return -Entry(self.record, a).reciprocal()
        return self.apply(Operation.RECIPROCAL)

    def __repr__(self) -> str:
        return f"Entry({self.record.names.get(self.step, self.step)})"

    def _times(self, number: Number) -> Any:
        if number == 0:
            return 0
        if number == 1:
            return self
        if number == -1:
            return -self
        operation, a, b = self.record.operation(self.step)
        if operation is Operation.MULTIPLY:
            for factor, rest in ((a, b), (b, a)):
                inner, value, _ = self.record.operation(factor)
                if inner is Operation.NUMBER:
                    return Entry(self.record, rest) * (number * value)
        if operation is Operation.NEGATE:
            return Entry(self.record, a) * -number
        return self.apply(Operation.MULTIPLY, number)


def is_number(value: Any) -> bool:
    """Whether a value is a number rather than an entry of a record."""
    return not isinstance(value, Entry)


def is_zero(value: Any) -> bool:
    """Whether a value is the number 0."""
    return not isinstance(value, Entry) and bool(value == 0)


def is_one(value: Any) -> bool:
    """Whether a value is the number 1."""
    return not isinstance(value, Entry) and bool(value == 1)


def step_of(record: Record, value: Any) -> int:
    """The step of a record that is an entry, or a number."""
    if isinstance(value, Entry):
        return value.step
    return record.number(value if is_exact(value) else float(value))
