"""Whether the answer of a record at a pose can be trusted: one number, a sum of flags."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from robostiff.record import Entry, Flag, Operation, Record, greater, least
from robostiff.recorded.leg import SHORT, lower_bound
from robostiff.recorded.robot import RecordedRobot

# Loss of a recorded pivot above which a pose is computed again. The record loses about as many
# digits as a loss has, and several one after the other more: of n losses each may be 1/sqrt(n) of
# it. Stiffness falls with the square of the wrenches that hold it: of those, at most a hundredth.
_SAFE = 1e4
_OUT_OF_REACH = -1e-3  # part of `reach` below which a pose is certainly out of reach
# An actuator nearer to a limit than this part of its range is looked at again.
_AT_LIMIT = 1e-9
# A gap between eigenvalues, as a part of them, below which their derivatives are rounding.
_APART = 1e-7
_FINITE = 1e300


def flags_of(robot: RecordedRobot, gaps: Sequence[Any] = ()) -> Any:
    """The sum of the flags at a pose, an entry.

    Gaps are those between eigenvalues whose derivatives are computed. Each test is written so that
    it fails where what it compares is no number.
    """
    record = robot.record
    losses = _entries([x for leg in robot.legs for x in leg.losses])
    others = _entries(robot.closure_losses)
    safe = _SAFE / max(len(losses) + len(others), 1) ** 0.5
    # Steps that are computed anyway: a test may use them for nothing.
    known = frozenset(record.steps_needed([x.step for x in _entries([*robot.K.values()])]))
    tests = _Tests(record, known)
    for loss in losses:
        tests.add_loss(loss, safe)
    for loss in others:  # of either sign
        tests.add(greater(safe**2, loss * loss))
    for test in robot.tests:
        tests.add(test)
    for part in _entries(robot.reach):
        tests.add_above(part, SHORT)
    nearest = reduce(least, limits) if (limits := _entries(robot.limits)) else None
    if nearest is not None:
        tests.add(greater(nearest * nearest, _AT_LIMIT**2))
    tests.add(greater(_FINITE, sum(robot.K[i, i] for i in range(robot.space.size))))
    of_rank, pivots = _Tests(record, known), _entries(robot.factors.losses)
    for loss in pivots:
        of_rank.add_loss(loss, _SAFE / len(pivots) ** 0.5)
    flags = Flag.DOUBTFUL * (1 - tests.all()) + Flag.RANK_DOUBTFUL * (1 - of_rank.all())
    # What is bounded from below is never out of reach.
    missed = [x for x in _entries(robot.reach) if lower_bound(record, x.step) < _OUT_OF_REACH]
    if missed:
        flags = flags + Flag.OUT_OF_REACH * greater(_OUT_OF_REACH, reduce(least, missed))
    if nearest is not None:
        flags = flags + Flag.BEYOND_LIMITS * greater(0, nearest)
    for flag, holds in robot.flags.items():
        flags = flags + holds * int(flag)
    if gaps := _entries(gaps):
        flags = flags + Flag.MEETING * (1 - greater(reduce(least, gaps), _APART))
    return flags


class _Tests:
    """Tests that a pose must pass, each 1 or 0, each written once."""

    def __init__(self, record: Record, known: frozenset[int]) -> None:
        self._record = record
        self._known = known
        self._bounds: dict[int, float] = {}  # steps that must be above a number
        self._others: dict[int, Any] = {}

    def all(self) -> Any:
        """1 where all of them are passed."""
        record = self._record
        bounds = [greater(Entry(record, step), least_) for step, least_ in self._bounds.items()]
        product: Any = 1
        for test in (*bounds, *self._others.values()):
            product = product * test
        return product

    def add(self, test: Any) -> None:
        """One that is 1 or 0 already."""
        if isinstance(test, Entry):
            self._others[test.step] = test

    def add_loss(self, loss: Entry, most: float) -> None:
        """A quotient must stay below a number; of positive numbers nothing is divided for that."""
        record = self._record
        operation, a, b = record.operation(loss.step)
        tests = [greater(most**2, loss * loss)]
        for inverse, other in ((a, b), (b, a)) if operation is Operation.MULTIPLY else ():
            inner, below, _ = record.operation(inverse)
            if inner is Operation.RECIPROCAL and np.all(record.sample(below) > 0):
                above = record.at(other)
                if isinstance(above, Entry):
                    tests.append(greater(Entry(record, below) * most, above))
                elif below in self._known or inverse not in self._known:
                    return self.add_above(Entry(record, below), float(above) / most)
                else:
                    tests.append(greater(most / float(above), Entry(record, inverse)))
        self.add(min(tests, key=self._more))

    def _more(self, entry: Entry) -> int:
        """How many steps more an entry takes."""
        return len(self._record.steps_needed([entry.step], self._known))

    def add_above(self, entry: Entry, number: float) -> None:
        """An entry must be above a number; of equal entries and their roots, the highest counts."""
        record = self._record
        simpler = record.simplify(entry, abs(float(np.mean(entry.sample))))
        if not isinstance(simpler, Entry) or self._more(simpler) <= self._more(entry):
            entry = simpler
        while isinstance(entry, Entry):
            operation, a, b = record.operation(entry.step)
            factor = record.at(b) if operation is Operation.MULTIPLY else 0
            if not isinstance(factor, Entry) and factor > 0:
                entry, number = record.at(a), number / float(factor)
            elif operation is Operation.SQUARE_ROOT and number >= 0:
                entry, number = record.at(a), number**2
            else:
                break
        if isinstance(entry, Entry):
            self._bounds[entry.step] = max(number, self._bounds.get(entry.step, -np.inf))
        elif not entry > number:
            self._others[-1] = 0


def _entries(values: Sequence[Any]) -> list[Entry]:
    """The different ones."""
    return list({value.step: value for value in values if isinstance(value, Entry)}.values())
