"""A program: the part of a record that some results need, and what its checks mean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import IntFlag
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from robostiff.frozen import frozen
from robostiff.record.record import NUMPY_FUNCTIONS, Operation, Record, step_of

#: Square of the gap, as a part of the length and radians, at which legs meet to the last digits.
CLOSED = 1e-12**2


class Flag(IntFlag):
    """What holds at a pose; 0 where the answer of the record is right as it is."""

    BEYOND_LIMITS = 1
    OUT_OF_REACH = 2
    DOUBTFUL = 4  # an assumption is close to failing
    RANK_DOUBTFUL = 8  # the pivots of K do not decide its rank
    MEETING = 16  # eigenvalues meet, which have no derivatives there


class Step(NamedTuple):
    """One operation of a program on the results of earlier steps."""

    operation: Operation
    a: int | None = None  # earlier steps; none for an input or a number
    b: int | None = None
    number: Any = 0.0
    name: str = ""  # of an input, or one that the record gave


@frozen(eq=False)
class _ReadSteps(Sequence[Step]):
    """Steps of a file, made when they are needed: at one pose few programs of a file run."""

    letters: str  # of the operations
    a: list[int]  # places of the arguments; -1 of none
    b: list[int]
    numbers: Mapping[int, float]  # by place
    names: Mapping[int, str]

    @cached_property
    def _steps(self) -> tuple[Step, ...]:
        count, operations = len(self), map(_OPERATIONS.__getitem__, self.letters)
        columns: list[list[Any]] = [[None if k < 0 else k for k in x] for x in (self.a, self.b)]
        columns += [0.0] * count, [""] * count
        for column, known in zip(columns[2:], (self.numbers, self.names), strict=True):
            for i, value in known.items():
                column[i] = value
        each = zip(operations, *columns, strict=True)
        return tuple(map(partial(tuple.__new__, Step), each))  # in half the time of `Step`

    def __len__(self) -> int:
        return len(self.letters)

    def __iter__(self) -> Iterator[Step]:
        return iter(self._steps)

    def __getitem__(self, place: Any) -> Any:
        return self._steps[place]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._steps == tuple(other)

    def __hash__(self) -> int:
        return hash(self._steps)


@frozen
class Program:
    """Operations without branches, from inputs to outputs.

    Attributes
    ----------
    inputs : tuple of str
        The first steps are the inputs, in this order.
    steps : sequence of Step
    outputs : tuple of int
        Steps that are the results.

    Examples
    --------
    >>> record = Record({"x": [1.0], "y": [2.0]})
    >>> x, y = record.input("x"), record.input("y")
    >>> program = Program.of(record, [x * y + 1, 3.0])
    >>> [float(value) for value in program.evaluated({"x": 2.0, "y": 5.0})]
    [11.0, 3.0]
    """

    inputs: tuple[str, ...]
    steps: Sequence[Step]
    outputs: tuple[int, ...]

    @classmethod
    def of(cls, record: Record, outputs: Sequence[Any], *, exact: bool = False) -> Program:
        """The program that computes entries of a record, or gives numbers.

        Parameters
        ----------
        record : Record
        outputs : sequence of Entry or number
        exact : bool
            Whether numbers of SymPy stay exact; otherwise they become floats.
        """
        wanted = [step_of(record, x) for x in outputs]
        steps = [Step(Operation.INPUT, name=name) for name in record.inputs]
        place = {record.input(name).step: i for i, name in enumerate(record.inputs)}
        for old in record.needed(wanted):
            if old in place:
                continue
            operation, a, b = record.operations[old]
            if operation is Operation.NUMBER:
                step = Step(operation, number=a if exact else float(a))
            else:
                second = None if b is None else place[b]
                step = Step(operation, place[a], second, name=record.names.get(old, ""))
            place[old] = len(steps)
            steps.append(step)
        return cls(record.inputs, tuple(steps), tuple(place[step] for step in wanted))

    @property
    def operations(self) -> int:
        """Number of operations, inputs and numbers not counted."""
        idle = (Operation.INPUT, Operation.NUMBER)
        return sum(step.operation not in idle for step in self.steps)

    def evaluated(
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
        known: list[Any] = []
        for step in self.steps:
            if step.operation is Operation.INPUT:
                known.append(values[step.name])
            elif step.operation is Operation.NUMBER:
                known.append(step.number)
            else:
                arguments = [known[k] for k in (step.a, step.b) if k is not None]
                known.append(table[step.operation](*arguments))
        return [known[i] for i in self.outputs]

    def as_data(self) -> dict[str, Any]:
        """The program as JSON has it: a letter for each operation, and places of its arguments.

        Numbers become floats.
        """
        numbers = [float(x.number) for x in self.steps if x.operation is Operation.NUMBER]
        inner = enumerate(self.steps[len(self.inputs) :], len(self.inputs))
        return {
            "inputs": list(self.inputs),
            "operations": "".join(_LETTERS[step.operation] for step in self.steps),
            "a": [-1 if step.a is None else step.a for step in self.steps],
            "b": [-1 if step.b is None else step.b for step in self.steps],
            "numbers": numbers,
            "names": {str(i): step.name for i, step in inner if step.name},
            "outputs": list(self.outputs),
        }

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Program:
        """From what `as_data` gave.

        Raises ValueError, TypeError or LookupError where it is none: a step may only work on steps
        before it, on as many as its operation takes.
        """
        letters = data["operations"]
        inputs, count = tuple(data["inputs"]), len(letters)
        a, b, outputs = (np.array(data[name], dtype=np.int64) for name in ("a", "b", "outputs"))
        place, kinds = np.arange(count), np.frombuffer(letters.encode("ascii"), dtype=np.uint8)
        taken = _ARGUMENTS[kinds]
        names = {int(i): str(name) for i, name in data["names"].items()} | dict(enumerate(inputs))
        are_steps = (
            a.shape == b.shape == (count,)
            and np.array_equal(kinds == ord(_LETTERS[Operation.INPUT]), place < len(inputs))
            and np.array_equal((a >= 0).astype(int) + (b >= 0), taken)
            and np.all((a >= b) | (taken == 2))
            and np.all((a < place) & (b < place))
            and np.all((outputs >= 0) & (outputs < count))
            and all(0 <= i < count for i in names)
        )
        if not are_steps:
            raise ValueError("a program whose steps work on others than those before them")
        is_number = np.flatnonzero(kinds == ord(_LETTERS[Operation.NUMBER])).tolist()
        numbers = dict(zip(is_number, map(float, data["numbers"]), strict=True))
        steps = _ReadSteps(letters, a.tolist(), b.tolist(), numbers, names)
        return cls(inputs, steps, tuple(outputs.tolist()))


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
