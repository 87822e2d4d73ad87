"""Records read as formulas in exact arithmetic: canonical fractions, step after step."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp

from robostiff.analytic.exact.closed_sum import fraction_in_factors, no_longer_than
from robostiff.analytic.exact.element import Element
from robostiff.analytic.exact.exact_points import ExactPoints, chooses_greater, exact
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.products import FormulaTooLargeError
from robostiff.analytic.reading.record_reading import ClosedReading
from robostiff.record import OPERATORS, Entry, Operation, Record

# Steps whose values are generators of a field: symbols, roots, sines and cosines.
_ANGLES = (Operation.ARC_COSINE, Operation.ARC_TANGENT)
_ATOMS = (Operation.INPUT, Operation.NUMBER, Operation.SQUARE_ROOT, Operation.SINE)
_ATOMS += (Operation.COSINE, Operation.HYPERBOLIC_TANGENT, *_ANGLES)


class ExactReading:
    """Writes entries of a record as canonical fractions, every step one of the same field.

    Steps that are equal up to a sign at random points in exact arithmetic are computed once.

    `symbols`: one for each input; `results`: everything that will be read; `limit`: most terms
    that a fraction may have on the way.

    Raises
    ------
    FormulaTooLargeError
        When a fraction would have more, or a result has an angle outside of sines and cosines,
        which no field has.

    Examples
    --------
    >>> record = Record({"x": [3.0, 4.0]})
    >>> x = record.input("x")
    >>> square = x * x - 1
    >>> reading = ExactReading(record, {"x": sp.Symbol("x")}, [square / (x + 1)], 10)
    >>> reading(square / (x + 1))
    x - 1
    """

    def __init__(
        self, record: Record, symbols: dict[str, sp.Symbol], results: Iterable[Any], limit: int
    ) -> None:
        wanted = [value.step for value in results if isinstance(value, Entry)]
        self._same = ExactPoints(record).same(record.needed(wanted))
        own = self._needed(record, wanted)
        if any(record.operations[step][0] in _ANGLES for step in own):
            raise FormulaTooLargeError(
                "closed form",
                got="an angle of the closure outside of sines and cosines",
                expected="roots, sines and cosines",
                hint="use named steps, form=Steps()",
            )
        closed = ClosedReading(record, symbols)
        atoms = {step: closed(Entry(record, step)) for step in own if _is_atom(record, step)}
        numbers = {same.factor for same in self._same.values()}
        self._field = ExactField([*atoms.values(), *numbers])
        self._known: dict[int, Element] = {}
        for step in own:
            is_atom = step in atoms
            found = self._field.element(atoms[step]) if is_atom else self._computed(record, step)
            self._known[step] = no_longer_than(found, limit)

    def __call__(self, value: Any) -> sp.Expr:
        """The expression of a number, or of an entry among the results."""
        if not isinstance(value, Entry):
            return exact(value)
        return fraction_in_factors(self._field, self._element(value.step))

    def _needed(self, record: Record, wanted: list[int]) -> list[int]:
        """The first of all steps that are equal, from atoms on, in order."""
        waiting, found = [self._same[step].step for step in wanted], set()
        while waiting:
            step = waiting.pop()
            if step is not None and step not in found:
                found.add(step)
                if not _is_atom(record, step):
                    waiting += [self._same[x].step for x in record.arguments(step)]
        return sorted(found)

    def _element(self, step: int) -> Element:
        same = self._same[step]
        if same.step is None:
            return self._field.element(same.factor)
        known = self._known[same.step]
        return known if same.factor == 1 else -known

    def _computed(self, record: Record, step: int) -> Element:
        operation, arguments = record.operations[step][0], record.arguments(step)
        if operation in (Operation.LEAST, Operation.GREATER):
            is_greater = chooses_greater(record, step)
            if operation is Operation.GREATER:
                return self._field.one if is_greater else self._field.zero
            return self._element(arguments[1 if is_greater else 0])
        return OPERATORS[operation](*map(self._element, arguments))


def _is_atom(record: Record, step: int) -> bool:
    return record.operations[step][0] in _ATOMS
