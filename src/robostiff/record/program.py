"""A program: the part of a record that some results need, and what its checks mean."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping, Sequence
from enum import IntFlag
from itertools import islice
from typing import Any

import numpy as np

from robostiff.frozen import frozen
from robostiff.record.record import NUMPY_FUNCTIONS, Operation, Record, step_of

#: Square of the gap, as a part of the length and radians, at which legs meet to the last digits.
CLOSED = 1e-12**2
#: Part of a determinant's size at home below which the direct closure looks at the assembly mode.
WATCHED = 0.1


class Flag(IntFlag):
    """What holds at a pose; 0 where the answer of the record is right as it is."""

    BEYOND_LIMITS = 1
    OUT_OF_REACH = 2
    DOUBTFUL = 4  # an assumption is close to failing
    RANK_DOUBTFUL = 8  # the pivots of K do not decide its rank
    MEETING = 16  # eigenvalues meet, which have no derivatives there
    INFEASIBLE = 32  # no tensions of cables within their limits balance the load
    UNTENSIONED = 64  # a cable has no tension
    UNBALANCED = 128  # given tensions do not balance the load


@frozen
class ProgramSteps:
    """Operations in order, each on the results of earlier ones."""

    operations: list[Operation]
    a: list[int]  # places of the arguments; -1 of none
    b: list[int]
    numbers: Mapping[int, float]  # by place

    def __hash__(self) -> int:
        return hash(tuple(self.operations))

    def __iter__(self) -> Iterator[tuple[Operation, int, int]]:
        return zip(self.operations, self.a, self.b, strict=True)


@frozen
class Program:
    """Operations without branches, from inputs to outputs."""

    inputs: tuple[str, ...]  #: the first steps are the inputs, in this order
    steps: ProgramSteps
    outputs: tuple[int, ...]  #: steps that are the results

    @classmethod
    def of(
        cls, record: Record, outputs: Sequence[Any], inputs: tuple[str, ...] | None = None
    ) -> Program:
        """The program that computes entries of a record, or gives numbers, which become floats.

        Parameters
        ----------
        record : Record
        outputs : sequence of Entry or number
        inputs : tuple of str, optional
            Those of the record on which the outputs depend, or more; all when left out.
        """
        wanted = [step_of(record, x) for x in outputs]
        inputs = record.inputs if inputs is None else inputs
        place = {record.input(name).step: i for i, name in enumerate(inputs)}
        numbers, count = dict[int, float](), len(place)
        operations, first, second = [Operation.INPUT] * count, [-1] * count, [-1] * count
        for old in record.steps_needed(wanted):
            if old in place:
                continue
            operation, a, b = record.operation(old)
            place[old] = new = len(operations)
            if operation is Operation.NUMBER:
                numbers[new], a = float(a), None
            operations.append(operation)
            first.append(-1 if a is None else place[a])
            second.append(-1 if b is None else place[b])
        steps = ProgramSteps(operations, first, second, numbers)
        return cls(inputs, steps, tuple(place[step] for step in wanted))

    @property
    def operations(self) -> int:
        """Number of operations, inputs and numbers not counted."""
        steps = self.steps
        return len(steps.operations) - len(self.inputs) - len(steps.numbers)

    def evaluate(
        self, values: Mapping[str, Any], functions: Mapping[Operation, Any] | None = None
    ) -> list[Any]:
        """Results at some values of the inputs, one operation after the other.

        Parameters
        ----------
        values : mapping of names to values
            Numbers, or whatever the functions work on.
        functions : mapping of operations to callables, optional
            NumPy's when left out.
        """
        table = NUMPY_FUNCTIONS if functions is None else functions
        known, steps = [values[name] for name in self.inputs], self.steps
        for operation, a, b in islice(steps, len(known), None):
            if b >= 0:
                known.append(table[operation](known[a], known[b]))
            elif a >= 0:
                known.append(table[operation](known[a]))
            else:
                known.append(steps.numbers[len(known)])
        return [known[i] for i in self.outputs]

    def as_data(self) -> dict[str, Any]:
        """The program as JSON has it: a letter for each operation, and places of its arguments."""
        steps = self.steps
        return {
            "inputs": list(self.inputs),
            "operations": "".join(_LETTERS[operation] for operation in steps.operations),
            **{name: _packed(own) for name, own in (("a", steps.a), ("b", steps.b))},
            "numbers": list(steps.numbers.values()),
            "outputs": _packed(self.outputs),
        }

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Program:
        """From what `as_data` gave.

        Raises ValueError, TypeError or LookupError where it is none: a step may only work on steps
        before it, on as many as its operation takes.
        """
        letters = data["operations"]
        inputs, count = tuple(data["inputs"]), len(letters)
        each = (b64decode(data[name], validate=True) for name in ("a", "b", "outputs"))
        a, b, outputs = (np.frombuffer(own, dtype=_PLACE) for own in each)
        place, kinds = np.arange(count), np.frombuffer(letters.encode("ascii"), dtype=np.uint8)
        taken = _ARGUMENTS[kinds]
        are_steps = (
            a.shape == b.shape == (count,)
            and np.array_equal(kinds == ord(_LETTERS[Operation.INPUT]), place < len(inputs))
            and np.array_equal((a >= 0).astype(int) + (b >= 0), taken)
            and np.all((a >= b) | (taken == 2))
            and np.all((a < place) & (b < place))
            and np.all((outputs >= 0) & (outputs < count))
        )
        if not are_steps:
            raise ValueError("a program whose steps work on others than those before them")
        is_number = np.flatnonzero(kinds == ord(_LETTERS[Operation.NUMBER])).tolist()
        numbers = dict(zip(is_number, map(float, data["numbers"]), strict=True))
        operations = [_OPERATIONS[letter] for letter in letters]
        steps = ProgramSteps(operations, a.tolist(), b.tolist(), numbers)
        return cls(inputs, steps, tuple(outputs.tolist()))


def _packed(places: Sequence[int]) -> str:
    """Places of steps as text, which is read in a tenth of the time of their digits."""
    return b64encode(np.array(places, dtype=_PLACE).tobytes()).decode()


_PLACE = "<i4"
_LETTERS = {operation: chr(ord("A") + i) for i, operation in enumerate(Operation)}
_OPERATIONS = {letter: operation for operation, letter in _LETTERS.items()}
_OF_TWO = (
    *(Operation.ADD, Operation.SUBTRACT, Operation.MULTIPLY),
    *(Operation.ARC_TANGENT, Operation.LEAST, Operation.GREATER),
)
# How many arguments each operation takes, by its letter; other letters are none.
_ARGUMENTS = np.full(128, -1)
_OF_ONE = set(Operation) - {Operation.INPUT, Operation.NUMBER, *_OF_TWO}
for _count, _own in ((0, (Operation.INPUT, Operation.NUMBER)), (1, _OF_ONE), (2, _OF_TWO)):
    _ARGUMENTS[[ord(_LETTERS[operation]) for operation in _own]] = _count
