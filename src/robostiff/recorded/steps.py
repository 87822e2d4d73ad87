"""Newton steps as records: each hands its size to the next, which tells whether they arrive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.record import ENTRY_FUNCTIONS, Program, Record, least

# Every step is at most half of the one before, or as small as rounding makes it; squares.
_CONTRACTION, _SMALL_STEP = 0.5**2, 1e-9**2
_LAST, _MARGIN = "size of the last step", "contraction"
#: What the first step finds of the one before.
BEFORE_FIRST = {_LAST: 1e300, _MARGIN: 1.0}


def handed_on(values: Mapping[str, Any], size: Any) -> list[Any]:
    """What a step of a size (its square) hands to the next, in the order of `BEFORE_FIRST`.

    The second is positive as long as every step is at most half of the one before.
    """
    kept = values[_LAST] * _CONTRACTION + _SMALL_STEP - size
    return [size, least(values[_MARGIN], kept)]


def contraction(values: Mapping[str, Any]) -> Any:
    """Positive where every step so far was at most half of the one before."""
    return values[_MARGIN]


@dataclass(frozen=True, kw_only=True)
class RecordedSteps:
    """Newton steps from a start.

    Attributes
    ----------
    inputs : tuple of str
    start : dict of names to floats
        The unknowns there.
    step : Program
        From inputs, unknowns, and what the last step handed on, to the next unknowns and the same
        of this step.
    arrival : Program
        What is computed from the same at the end; what stays open (squared), and a number that is
        positive where all is well, come last.
    first : Program or None
        The first step, or several of them, where these are shorter than the others.
    first_steps : int
        How many it takes.
    steps, most_steps : int
        How many are usually enough, and how many may be taken.
    """

    inputs: tuple[str, ...]
    start: dict[str, float]
    step: Program
    arrival: Program
    first: Program | None = None
    first_steps: int = 1
    steps: int = 4
    most_steps: int = 6

    @property
    def state(self) -> dict[str, float]:
        """What the first step begins with, by name."""
        return self.start | BEFORE_FIRST

    def arrived(self, program: Program) -> Program:
        """A program at the end of the steps, as one of inputs and state."""
        record = self.empty_record((*self.inputs, *self.state))
        values = {name: record.input(name) for name in record.inputs}
        return Program.of(record, self.ended(program, values))

    def composed(self, program: Program) -> Program:
        """The same with the steps before it, from the inputs alone."""
        record = self.empty_record(self.inputs)
        values: dict[str, Any] = {name: record.input(name) for name in self.inputs}
        values |= self.state
        for step in [self.first or self.step, *[self.step] * (self.steps - self.first_steps)]:
            after = step.evaluated(values, ENTRY_FUNCTIONS)
            values |= zip(self.state, after, strict=True)
        return Program.of(record, self.ended(program, values))

    def ended(self, program: Program, values: Mapping[str, Any]) -> list[Any]:
        """Results of a program at the end of the steps."""
        return program.evaluated(values, ENTRY_FUNCTIONS)

    def empty_record(self, names: Sequence[str]) -> Record:
        """A record in which nothing is decided by samples: what is alike at home need not stay."""
        return Record({name: np.array([self.state.get(name, 0.0)]) for name in names})
