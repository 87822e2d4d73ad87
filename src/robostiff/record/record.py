"""A record: a list of operations in which equal operations occur once."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, NoAnswerError

if TYPE_CHECKING:
    from robostiff.record.entry import Entry


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
    Operation.INPUT: 0,
    Operation.NUMBER: 0,
    Operation.ADD: 1,
    Operation.SUBTRACT: 1,
    Operation.MULTIPLY: 1,
    Operation.NEGATE: 1,
    Operation.RECIPROCAL: 5,
    Operation.SQUARE_ROOT: 6,
    Operation.SINE: 15,
    Operation.COSINE: 15,
    Operation.ARC_COSINE: 30,
    Operation.ARC_TANGENT: 30,
    Operation.HYPERBOLIC_TANGENT: 30,
    Operation.LEAST: 1,
    Operation.GREATER: 1,
}


class Record:
    """Operations in the order in which they can be computed.

    Every step also carries its value at a few sample points. They distinguish a formula that is
    zero everywhere from one that is not, and which pivots are safe.

    Parameters
    ----------
    inputs : mapping of names to (samples,) arrays
        What the formulas depend on, with values at generic points.
    most : int, optional
        How many steps it may have. One more raises a `NoAnswerError`.

    Examples
    --------
    >>> record = Record({"x": [1.0, 2.0]})
    >>> x = record.input("x")
    >>> ((x + 1) * (1 + x)).sample
    array([4., 9.])
    >>> record.size
    4
    """

    def __init__(self, inputs: Mapping[str, ArrayLike], most: int | None = None) -> None:
        samples = {name: np.array(values, dtype=float) for name, values in inputs.items()}
        shapes = {values.shape for values in samples.values()}
        if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
            raise InputError("samples of the inputs", expected="as many for each input")
        self.count = next(iter(shapes))[0] if shapes else 1
        self.inputs, self.most = tuple(samples), most
        self.operations: list[tuple[Operation, Any, Any]] = []
        self._samples = np.empty((64, self.count))
        self.names: dict[int, str] = {}
        #: Sine and cosine of angles that come from them.
        self.turns: dict[int, tuple[Any, Any]] = {}
        self._known: dict[tuple[Operation, Any, Any], int] = {}
        self._by_value: dict[tuple[int, int], list[int]] = {}
        for name, values in samples.items():
            self._append((Operation.INPUT, name, None), values)

    def sample(self, step: int) -> np.ndarray:
        """Value of a step at the sample points (samples,)."""
        return self._samples[step].copy()

    @property
    def size(self) -> int:
        """Number of steps, inputs and numbers included."""
        return len(self.operations)

    def input(self, name: str) -> Entry:
        """The input of a name."""
        from robostiff.record.entry import Entry

        return Entry(self, self._known[Operation.INPUT, name, None])

    def add_input(self, name: str, sample: ArrayLike) -> Entry:
        """One more input, after those of before, with its values at the sample points.

        An input that exists already is returned as it is.
        """
        if name not in self.inputs:
            self.inputs = (*self.inputs, name)
            self._append((Operation.INPUT, name, None), np.broadcast_to(sample, self.count))
        return self.input(name)

    @contextmanager
    def tentative(self) -> Iterator[None]:
        """Forget the steps, inputs and names that are added within; their entries are void then.

        Examples
        --------
        >>> record = Record({"x": [1.0, 2.0]})
        >>> with record.tentative():
        ...     _ = record.input("x") + 1
        >>> record.size
        1
        """
        size, inputs, names = self.size, self.inputs, dict(self.names)
        try:
            yield
        finally:
            for step in range(self.size - 1, size - 1, -1):
                self._known.pop(self.operations.pop(), None)  # the last may be half a step
                alike = self._by_value.get(_leading_digits(self._samples[step, 0]), [])
                if alike[-1:] == [step]:
                    alike.pop()
            self.inputs, self.names = inputs, names
            self.turns = {step: turn for step, turn in self.turns.items() if step < size}

    def number(self, value: Any) -> int:
        """The step of a number."""
        key = (Operation.NUMBER, value, None)
        if key not in self._known:
            self._append(key, np.full(self.count, float(value)))
        return self._known[key]

    def step(self, operation: Operation, a: int, b: int | None = None) -> int:
        """The step that does an operation on earlier ones, written once."""
        if b is not None and operation in _SYMMETRIC and b < a:
            a, b = b, a
        key = (operation, a, b)
        known = self._known.get(key)
        if known is not None:
            return known
        samples = self._samples
        with np.errstate(all="ignore"):
            value = (
                NUMPY_FUNCTIONS[operation](samples[a])
                if b is None
                else NUMPY_FUNCTIONS[operation](samples[a], samples[b])
            )
        return self._append(key, value)

    def simplified(self, value: Any, scale: float = 1.0) -> Any:
        """A simpler entry or number with the same value at all samples, if there is one.

        Identities such as cos^2 + sin^2 = 1 are found by value: two formulas that agree to 12
        digits at several generic points are taken for one.

        Parameters
        ----------
        scale : float
            Size against which a value counts as zero.
        """
        from robostiff.record.entry import Entry
        from robostiff.record.functions import shortened

        if not isinstance(value, Entry):
            short = shortened(value)
            return 0 if short is not value and abs(float(short)) <= _SAME * scale else short
        own = self._samples[value.step]
        first = float(own[0])  # most differ at the first sample
        for number, near in ((0, _SAME * scale), (1, _SAME), (-1, _SAME)):
            if abs(first - number) <= near and np.all(np.abs(own - number) <= near):
                return number
        alike = self._first_alike(value.step)
        if alike is None:
            return value
        simpler = self.at(alike)
        return simpler if self._samples[alike, 0] * own[0] > 0 else -simpler

    def _first_alike(self, step: int) -> int | None:
        """The first step with the same values up to one sign, before this one."""
        own = self._samples[step]
        exponent, digits = _leading_digits(own[0])
        found = [
            earlier
            for k in (digits - 1, digits, digits + 1)
            for earlier in self._by_value.get((exponent, k), ())
            if earlier < step
        ]
        for earlier in sorted(found):
            other = self._samples[earlier]
            sign = 1.0 if other[0] * own[0] > 0 else -1.0
            if np.all(np.abs(other - sign * own) <= _SAME * np.abs(own)):
                return earlier
        return None

    def at(self, step: int) -> Any:
        """The entry of a step; a number stays a number."""
        from robostiff.record.entry import Entry

        operation, number, _ = self.operations[step]
        return number if operation is Operation.NUMBER else Entry(self, step)

    def needed(self, outputs: Iterable[int]) -> list[int]:
        """The steps on which some others depend, in order, themselves included."""
        wanted = set()
        waiting = list(outputs)
        while waiting:
            step = waiting.pop()
            if step not in wanted:
                wanted.add(step)
                waiting.extend(self.arguments(step))
        return sorted(wanted)

    def arguments(self, step: int) -> tuple[int, ...]:
        """The steps on which a step works."""
        operation, a, b = self.operations[step]
        if operation in (Operation.INPUT, Operation.NUMBER):
            return ()
        return (a,) if b is None else (a, b)

    def cost(self, outputs: Iterable[int]) -> int:
        """Cost of some steps, in additions."""
        return sum(COSTS[self.operations[step][0]] for step in self.needed(outputs))

    def _append(self, key: tuple[Operation, Any, Any], sample: np.ndarray) -> int:
        step = len(self.operations)
        if step == self.most:
            raise NoAnswerError(f"a record of more than {self.most} operations")
        if step == len(self._samples):
            self._samples = np.concatenate([self._samples, np.empty_like(self._samples)])
        self.operations.append(key)
        self._samples[step] = sample
        self._known[key] = step
        self._by_value.setdefault(_leading_digits(sample[0]), []).append(step)
        return step


def _leading_digits(x: float) -> tuple[int, int]:
    """Exponent and some ten digits of a size, to find steps of nearly the same value."""
    if not math.isfinite(x):
        return 0, 0
    mantissa, exponent = math.frexp(abs(x))
    return exponent, int(mantissa * _DIGITS)


_SYMMETRIC = {Operation.ADD, Operation.MULTIPLY, Operation.LEAST}
