"""Records read as formulas: closed expressions, or named steps one after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition
from robostiff.record import Entry, Operation, Record

_FUNCTIONS: dict[Operation, Any] = {
    Operation.ADD: lambda a, b: a + b,
    Operation.SUBTRACT: lambda a, b: a - b,
    Operation.MULTIPLY: lambda a, b: a * b,
    Operation.NEGATE: lambda a: -a,
    Operation.RECIPROCAL: lambda a: 1 / a,
    Operation.SQUARE_ROOT: sp.sqrt,
    Operation.SINE: sp.sin,
    Operation.COSINE: sp.cos,
    Operation.ARC_COSINE: sp.acos,
    Operation.ARC_TANGENT: sp.atan2,
    Operation.LEAST: sp.Min,
    Operation.GREATER: lambda a, b: sp.Piecewise((1, a > b), (0, True)),
}


class ClosedReading:
    """Writes entries of a record as expressions of its inputs alone.

    Parameters
    ----------
    record : Record
    symbols : dict of names to SymPy symbols
        One for each input.

    Examples
    --------
    >>> record = Record({"x": [3.0]})
    >>> x = record.input("x")
    >>> ClosedReading(record, {"x": sp.Symbol("x")})(1 / (x * x + 1))
    1/(x**2 + 1)
    """

    def __init__(self, record: Record, symbols: dict[str, sp.Symbol]) -> None:
        self.record = record
        self.symbols = symbols
        self._known: dict[int, sp.Expr] = {}

    def __call__(self, value: Any) -> sp.Expr:
        """The expression of an entry or number."""
        if not isinstance(value, Entry):
            return exact(value)
        for step in self.record.needed([value.step]):
            if step not in self._known:
                self._known[step] = self.written(step, self._known)
        return self._known[value.step]

    def written(self, step: int, known: dict[int, Any]) -> sp.Expr:
        """One step in terms of others that are known."""
        operation, a, _ = self.record.operations[step]
        if operation is Operation.INPUT:
            return self.symbols[a]
        if operation is Operation.NUMBER:
            return exact(a)
        arguments = [known[argument] for argument in self.record.arguments(step)]
        return _FUNCTIONS[operation](*arguments)


class StepReading:
    """Writes entries of a record in named steps: what is used twice, or has a name, is defined.

    Parameters
    ----------
    record : Record
    symbols : dict of names to SymPy symbols
        One for each input.
    results : iterable of entries and numbers
        Everything that will be read.

    Attributes
    ----------
    definitions : tuple of Definition
        In the order in which they can be computed.

    Examples
    --------
    >>> record = Record({"x": [3.0]})
    >>> x = record.input("x")
    >>> root = (x + 1).named("r")
    >>> reading = StepReading(record, {"x": sp.Symbol("x")}, [root * root])
    >>> reading.definitions, reading(root * root)
    ((Definition(symbol=r, expression=x + 1),), r**2)
    """

    def __init__(
        self, record: Record, symbols: dict[str, sp.Symbol], results: Iterable[Any]
    ) -> None:
        wanted = [value.step for value in results if isinstance(value, Entry)]
        steps = record.needed(wanted)
        uses = Counter(wanted)
        for step in steps:
            # A square uses its argument once, as a reader sees it.
            uses.update(set(record.arguments(step)))
        reading = ClosedReading(record, symbols)
        taken = {*record.inputs, *record.names.values()}
        count = 0
        self._known: dict[int, sp.Expr] = {}
        definitions = []
        for step in steps:
            expression = reading.written(step, self._known)
            name = record.names.get(step)
            if name is None and uses[step] > 1 and not _is_plain(record, step):
                count, name = _free_name(count, taken)
            if name is not None and not _is_plain(record, step):
                symbol = sp.Symbol(name, real=True)
                definitions.append(Definition(symbol, expression))
                expression = symbol
            self._known[step] = expression
        self.definitions = tuple(definitions)

    def __call__(self, value: Any) -> sp.Expr:
        """The expression of an entry or number that was among the results."""
        return self._known[value.step] if isinstance(value, Entry) else exact(value)


def exact(number: Any) -> sp.Expr:
    """A number as SymPy has it; a float as the decimal that it prints as."""
    written = sp.sympify(number)
    return sp.nsimplify(written, rational=True) if written.has(sp.Float) else written


def _free_name(count: int, taken: set[str]) -> tuple[int, str]:
    count += 1
    while f"t_{count}" in taken:
        count += 1
    return count, f"t_{count}"


def _is_plain(record: Record, step: int) -> bool:
    """Whether a step is not worth a name: an input, a number, or the negative of one."""
    operation, a, _ = record.operations[step]
    if operation is Operation.NEGATE:
        return _is_plain(record, a)
    return operation in (Operation.INPUT, Operation.NUMBER)
