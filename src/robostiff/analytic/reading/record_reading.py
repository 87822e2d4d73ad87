"""Records read as formulas: closed expressions, or named steps one after the other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from itertools import combinations, count, product
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import spend
from robostiff.analytic.exact.definition import (
    Definition,
    count_of,
    is_shorter_negated,
    used_definitions,
)
from robostiff.analytic.exact.element import power_of
from robostiff.analytic.exact.exact_points import ExactPoints, Same, chooses_greater, exact
from robostiff.analytic.exact.field import shared_field
from robostiff.frozen import frozen
from robostiff.record import OPERATORS, Entry, Operation, Record

_FUNCTIONS: dict[Operation, Any] = {
    **OPERATORS,
    Operation.RECIPROCAL: power_of,
    Operation.SQUARE_ROOT: sp.sqrt,
    Operation.SINE: sp.sin,
    Operation.COSINE: sp.cos,
    Operation.ARC_COSINE: sp.acos,
    Operation.ARC_TANGENT: sp.atan2,
    Operation.HYPERBOLIC_TANGENT: sp.tanh,
}

_CLOSED = 1e-10  # of the terms: rounding of a closed posture
_SAME = 1e-11  # of a value: rounding at the samples
_TURNING = (Operation.SINE, Operation.COSINE)
_FACTORS = (Operation.INPUT, Operation.SQUARE_ROOT, *_TURNING)
_SHORT = 4  # most operations of a number that is written without a name
_MULTIPLIED_OUT = 200  # of a radicand: whether it becomes shorter then is tried up to here


class ClosedReading:
    """Writes entries of a record as expressions of its inputs.

    Where the record chooses between two entries, the choice of its samples is taken.

    `symbols`: one for each input.
    """

    def __init__(self, record: Record, symbols: dict[str, sp.Symbol]) -> None:
        self.record = record
        self.symbols = symbols
        self._known: dict[int, sp.Expr] = {}

    def __call__(self, value: Any) -> sp.Expr:
        """The expression of an entry or number."""
        if not isinstance(value, Entry):
            return exact(value)
        for step in self.record.steps_needed([value.step]):
            if step not in self._known:
                self._known[step] = self.written(step, self._known)
        return self._known[value.step]

    def written(self, step: int, known: dict[int, Any]) -> sp.Expr:
        """One step in terms of the steps before it."""
        spend()
        operation, a, _ = self.record.operation(step)
        if operation is Operation.INPUT:
            return self.symbols[a]
        if operation is Operation.NUMBER:
            return exact(a)
        a, b, *_ = [*self.record.arguments(step), None]
        if operation in (Operation.LEAST, Operation.GREATER):
            is_greater = chooses_greater(self.record, step)
            if operation is Operation.GREATER:
                return sp.Integer(is_greater)
            return known[b if is_greater else a]
        arguments = [known[argument] for argument in self.record.arguments(step)]
        if operation is Operation.SQUARE_ROOT:
            (radicand,) = arguments
            if count_of(radicand) <= _MULTIPLIED_OUT and not radicand.has(sp.sin, sp.cos):
                # Multiplied out where that is not longer.
                field = shared_field(radicand)
                plain = field.expression(field.element(radicand))
                radicand = plain if count_of(plain) <= count_of(radicand) else radicand
            return sp.sqrt(radicand)
        return _FUNCTIONS[operation](*arguments)


class StepReading:
    """Writes entries of a record in named steps: entries used twice, or with a name, are defined.

    What is zero or another number at random points in exact arithmetic is that number, and what is
    equal up to a sign has one name.

    `symbols`: one for each input; `results`: everything that will be read; `springs`: what some
    of the inputs stand for;
    `at_closed_postures`: whether inputs follow from the closure of legs: then a sum that
    vanishes at all samples is zero where the legs close, and nowhere else, so that no exact
    point can decide it; `definitions`: in the order in which they can be computed.
    """

    def __init__(
        self,
        record: Record,
        symbols: dict[str, sp.Symbol],
        results: Iterable[Any],
        springs: Iterable[Definition] = (),
        *,
        at_closed_postures: bool = False,
    ) -> None:
        wanted = [value.step for value in results if isinstance(value, Entry)]
        points = ExactPoints(record)
        self._same = points.same(record.steps_needed(wanted))
        if at_closed_postures:
            self._close(record)
        self._shorten(record, points)
        steps, uses = self._needed(record, wanted)
        self._record = record
        self._reading = reading = ClosedReading(record, symbols)
        given: set[str] = set()
        taken = {*record.inputs, *record.names.values()}
        free = (x for i in count(1) if (x := f"t_{i}") not in taken)
        self._written: dict[int, sp.Expr] = {}
        definitions = list(springs)
        multiples: dict[Any, tuple[Any, Any]] = {}
        for step in steps:
            arguments = {x: self._of_step(x) for x in record.arguments(step)}
            expression = reading.written(step, arguments)
            if expression.is_Add and any(x.is_Mul and x.has(sp.Add) for x in expression.args):
                plain = sp.Add(*(sp.expand_mul(x, deep=False) for x in expression.args))
                expression = min(expression, plain, key=count_of)
            if expression.is_Mul and not expression.args[0].is_Symbol:
                number, rest = _number_and_rest(expression)
                if rest in multiples:  # sqrt(3) t_1, where that is shorter
                    other, symbol = multiples[rest]
                    expression = min(expression, number / other * symbol, key=count_of)
            is_minus = is_shorter_negated(expression)
            # A negative sum is used with its sign, and so is a product without a name.
            given_name = None if is_minus and expression.is_Add else record.names.get(step)
            name = None
            if given_name is not None:  # without blanks and the like, given once
                name = re.sub(r"\W", "_", given_name)
                while name in given or (name != given_name and name in taken):
                    name += "_"
                given.add(name)
            if name is None and uses[step] > 1 and not _is_trivial(expression):
                name = next(free)
            if name is not None and not _is_trivial(expression):
                symbol = sp.Symbol(name, real=True)
                is_minus = is_minus and given_name is None
                definitions.append(Definition(symbol, -expression if is_minus else expression))
                expression = -symbol if is_minus else symbol
                number, rest = _number_and_rest(definitions[-1].expression)
                if number != 1:
                    multiples.setdefault(rest, (number, symbol))
            self._written[step] = expression
        self.definitions: tuple[Definition, ...] = used_definitions(
            definitions, [self._of_step(step) for step in wanted]
        )

    def __call__(self, value: Any) -> sp.Expr:
        """The expression of a number, or of an entry among the results or made from them."""
        return self._of_step(value.step) if isinstance(value, Entry) else exact(value)

    #: A length; it has a name where it is used twice.
    length = __call__

    def fraction(self, expression: Any) -> Any:
        """An expression of what was read, as it is."""
        return expression

    def _needed(self, record: Record, wanted: list[int]) -> tuple[list[int], Counter[int | None]]:
        """The first of all steps that are alike, in order, and how often each is used."""
        waiting = [self._same[step].step for step in wanted]
        uses = Counter(waiting)
        steps = set()
        while waiting:
            step = waiting.pop()
            if step is None or step in steps:
                continue
            steps.add(step)
            # A square counts as one use of its argument.
            arguments = {self._same[x].step for x in record.arguments(step)}
            uses.update(arguments)
            waiting.extend(arguments)
        # Steps after those on which they work; some were added behind all others.
        found: dict[int, None] = {}
        waiting = sorted(steps, reverse=True)
        while waiting:
            step = waiting[-1]
            known = (self._same[x].step for x in record.arguments(step))
            before = {x for x in known if x is not None and x not in found}
            if before and step not in found:
                waiting += sorted(before, reverse=True)
            else:
                found[waiting.pop()] = None
        for step in reversed(found):
            # Dividing by something twice is as short as a name for its reciprocal.
            if record.operations[step] is Operation.RECIPROCAL and step not in record.names:
                (below,) = (self._same[x].step for x in record.arguments(step))
                uses[below] += uses[step] - 1
                uses[step] = 1
        return list(found), uses

    def _close(self, record: Record) -> None:
        """Sums that are zero where the legs close, and steps that are others there."""
        first: dict[tuple[str, ...], tuple[int, int]] = {}
        others: dict[int | None, Same] = {}
        for step in sorted(self._same):
            same, at, operation = self._same[step], record.sample(step), record.operations[step]
            if operation in (Operation.ADD, Operation.SUBTRACT):
                size = max(np.min(np.abs(record.sample(a))) for a in record.arguments(step))
                if size > 0 and np.max(np.abs(at)) <= _CLOSED * size:
                    others[step] = self._same[step] = Same(None, sp.Integer(0))
                    continue
            if same.step in others:
                other = others[same.step]
                self._same[step] = Same(other.step, other.factor * same.factor)
            elif same.step == step:
                sign = 1 if at[0] > 0 else -1
                digits = tuple(f"{x:.9e}" for x in sign * at)
                known, other_sign = first.setdefault(digits, (step, sign))
                if known != step and operation is not Operation.INPUT:
                    others[step] = self._same[step] = Same(known, sp.Integer(sign * other_sign))

    def _shorten(self, record: Record, points: ExactPoints) -> None:
        """Sums that are the cosine or sine of a sum of angles, or a product of two short steps."""
        shorter = _ShorterSteps.of(record, points, self._same)
        replaced: dict[int, Same] = {}
        for step in sorted(self._same):
            same, operation = self._same[step], record.operations[step]
            if same.step in replaced:
                other = replaced[same.step]
                self._same[step] = Same(other.step, other.factor * same.factor)
            elif same.step == step and operation in (Operation.ADD, Operation.SUBTRACT):
                found = shorter.equal_to(step)
                name = record.names.get(step)
                if found is None or (name is not None and found[1] < 0):
                    continue
                for argument in record.steps_needed([found[0]]):
                    self._same.setdefault(argument, Same(argument, sp.Integer(1)))
                if name is not None:
                    record.names.setdefault(found[0], name)
                self._same[step] = replaced[step] = Same(found[0], sp.Integer(found[1]))

    def _of_step(self, step: int) -> Any:
        same = self._same.setdefault(step, Same(step, sp.Integer(1)))
        if same.step is None:
            return same.factor
        if same.step not in self._written:  # found after the others were read, of which it is made
            arguments = {x: self._of_step(x) for x in self._record.arguments(same.step)}
            self._written[same.step] = self._reading.written(same.step, arguments)
        written = self._written[same.step]
        return written if same.factor == 1 else same.factor * written


@frozen
class _ShorterSteps:
    """Finds steps that are a sine of two angles, or the product of two inputs, sines or roots."""

    record: Record
    points: ExactPoints  # which confirm products that the samples suggest
    turned: list[int]  # sines and cosines of sums and differences of two angles
    steps: np.ndarray  # (n,): possible factors, by the size of their first sample
    values: np.ndarray  # (n, count): of them at the samples

    @classmethod
    def of(cls, record: Record, points: ExactPoints, same: dict[int, Same]) -> _ShorterSteps:
        short = [x for x in same if record.operations[x] in _FACTORS]
        short.sort(key=lambda x: abs(record.sample(x)[0]))
        kept = [x for x in short if np.all(record.sample(x))]
        values = np.array([record.sample(x) for x in kept]).reshape(len(kept), record.count)
        turning = (x for x in same if same[x].step == x and record.operations[x] in _TURNING)
        uses = Counter(same[argument].step for x in turning for argument in record.arguments(x))
        # Of a sine or cosine that is a number, the other one is short, too.
        angles = sorted(x for x, times in uses.items() if x is not None and times > 1)
        each = [Entry(record, x) for x in angles]
        sums = [x for a, b in combinations(each, 2) for x in (a + b, a - b)]
        entries = [x for x in map(record.simplify, sums) if isinstance(x, Entry)]
        turned = [x.apply(kind).step for x in entries for kind in _TURNING]
        return cls(record, points, turned, np.array(kept, dtype=int), values)

    def equal_to(self, step: int) -> tuple[int, int] | None:
        """The shorter step that a step is, and its sign."""
        if self.points.count < 2 or not len(self.steps):
            return None
        sample = self.record.sample(step)
        for other, sign in product(self.turned, (1, -1)):
            if np.all(np.abs(sample - sign * self.record.sample(other)) <= _SAME):
                return other, sign
        sizes = np.abs(self.values[:, 0])
        wanted = np.abs(sample[0]) / sizes
        places = np.minimum(np.searchsorted(sizes, wanted * (1 - _SAME)), len(sizes) - 1)
        for i in np.nonzero(np.abs(sizes[places] - wanted) <= _SAME * wanted)[0]:
            j, ratio = places[i], sample / self.values[i]
            for sign in (1, -1):
                off = np.abs(ratio - sign * self.values[j])
                if np.all(off <= _SAME * np.abs(self.values[j])):
                    a, b = sorted((int(self.steps[i]), int(self.steps[j])))
                    if a < b < step and self.points.are_equal(step, (a, b), sign):
                        return self.record.step(Operation.MULTIPLY, a, b), sign
        return None


def written_size(record: Record, results: Iterable[Any]) -> int:
    """Operations of the longest result, written out without names."""
    wanted = [value.step for value in results if isinstance(value, Entry)]
    sizes: dict[int, int] = {}
    for step in record.steps_needed(wanted):
        sizes[step] = 1 + sum(sizes[argument] for argument in record.arguments(step))
    return max((sizes[step] for step in wanted), default=0)


def _number_and_rest(expression: Any) -> tuple[Any, Any]:
    if not expression.is_Mul:
        return sp.Integer(1), expression
    numbers = [x for x in expression.args if x.is_number]
    return sp.Mul(*numbers), sp.Mul(*(x for x in expression.args if not x.is_number))


def _is_trivial(expression: sp.Expr) -> bool:
    """Whether an expression is not worth a name: a symbol or its negative, or a short number."""
    if expression.is_number:
        return count_of(expression) <= _SHORT
    factors = expression.args if expression.is_Mul else (sp.S.NegativeOne, expression)
    return len(factors) == 2 and factors[0] is sp.S.NegativeOne and factors[1].is_Symbol
