"""Newton steps from home, and what follows them, run at poses."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.compiled.codes import ArrayCode, MachineCode, Rows, chunks_of, in_shares
from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.assembly_mode import SHORTEST, straight_ways
from robostiff.record import CLOSED, WATCHED, Program

if TYPE_CHECKING:
    from robostiff.recorded.closure import RecordedSteps

Code = MachineCode | ArrayCode

# Operations up to which all steps are written out; beyond, compilers take their time.
_LONGEST = 8000
# Poses at once: their inputs and unknowns should stay in the second-level cache. Chosen as
# `POSES_A_CHUNK`.
_CHUNK = 1016
# Poses that need more steps: so many are worth machine code of their own.
_MANY = 500
# Square of a step after which the next would be rounding; and the part of some poses that may be
# left behind when all of them take a step more.
_ENOUGH, _LEFT = 1e-8**2, 0.25
# The shortest part of a way that leads to results.
_SHORTEST_PART = 1.0 / 64.0


@frozen
class StepCodes:
    """Steps one by one: the first ones, one from what the last handed on, and what follows them."""

    first: Code
    step: Code
    last: Code  # the program behind the steps
    # Coordinates of the legs, and whether the steps of a closure arrive; with it, what is too far
    # from home for all steps at once is reached in parts of the straight way
    arrival: Code | None = None

    def by(self, code: Callable[[Program], Code]) -> StepCodes:
        """The same programs, run by another code."""
        programs = (self.first, self.step, self.last, self.arrival)
        return StepCodes(*(program and program.by(code) for program in programs))  # pyright: ignore[reportArgumentType]


@frozen
class ClosedCode:
    """Runs a program of leg coordinates at poses, each closed by four to six steps; picklable."""

    # Inputs at home, from which far poses are reached in parts of the straight way
    home: tuple[float, ...]
    state: tuple[float, ...]  # what the first step begins with: the unknowns, and what is handed on
    unknowns: int  # how many there are
    first_steps: int  # how many steps the first program takes
    steps: int  # how many are usually enough
    most_steps: int
    # The usual number of steps and the program in one; None where that is too long
    whole: Code | None
    # One by one, for many poses and for so few that they are not worth compiling
    many: StepCodes
    few: StepCodes

    @classmethod
    def of(
        cls, closure: RecordedSteps, program: Program, code: Callable[[Program], Code]
    ) -> ClosedCode:
        """The code of a program of leg coordinates."""
        from robostiff.recorded import RecordedClosure

        arrival, home = None, ()
        if isinstance(closure, RecordedClosure):
            arrival = ArrayCode(closure.arrival)
            home = tuple(closure.home.values())
        program = closure.at_end(program)
        first, step, last = map(ArrayCode, (closure.first_step, closure.step, program))
        few = StepCodes(first, step, last, arrival)
        whole = closure.after_all_steps(program) if closure.step.operations <= _LONGEST else None
        is_short = whole is not None and whole.operations <= _LONGEST
        return cls(
            home=home,
            state=tuple(closure.state.values()),
            unknowns=len(closure.start),
            first_steps=closure.first_steps,
            steps=closure.steps,
            most_steps=closure.most_steps,
            whole=code(whole) if is_short and whole else None,
            many=few,
            few=few,
        ).by(code)

    def by(self, code: Callable[[Program], Code]) -> ClosedCode:
        """The same programs, run by another code."""
        many = self.few if code is ArrayCode else self.few.by(code)
        return replace(self, whole=self.whole and self.whole.by(code), many=many)

    @property
    def operations(self) -> int:
        """Number of operations a pose takes, with the usual number of steps."""
        if self.whole is not None:
            return self.whole.operations
        others = (self.steps - self.first_steps) * self.many.step.operations
        return self.many.first.operations + others + self.many.last.operations

    @property
    def rows(self) -> int:
        """Number of results."""
        return self.many.last.rows

    def evaluate(self, inputs: np.ndarray, outputs: Rows, threads: int = 1) -> None:
        """Fill `outputs` (results, N) from `inputs` (inputs, N), float64."""
        if self.whole is None:
            self._loop(self.many, inputs, outputs, threads)
        else:
            self.whole.evaluate(inputs, outputs, threads)
            is_open = ~_arrives(outputs)
            if not is_open.any():
                return
            again = np.flatnonzero(is_open & (outputs[-1] > 0))
            if again.size:
                more = np.empty((self.rows, again.size))
                codes = self.few if again.size < _MANY else self.many
                self._loop(codes, np.ascontiguousarray(inputs[:, again]), more, threads)
                _put(outputs, again, more)
        far = np.flatnonzero(~_arrives(outputs))
        for first in range(0, far.size, _CHUNK):
            self._reach(inputs, outputs, far[first : first + _CHUNK])

    def at_one(self, inputs: list[float]) -> list[float] | None:
        """Results at one pose on plain numbers; None where the usual steps do not arrive."""
        found = self.whole.at_one(inputs) if isinstance(self.whole, ArrayCode) else None
        return None if found is None or not _arrives(found) else found

    def ways(self, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far the straight ways from home to poses (inputs, N) lead, up to singularities.

        Parts of them (N,), and coordinates of all legs there (joints, N).
        """
        assert self.few.arrival is not None  # noqa: S101 - of a closure
        gone, x = self._gone(self.few, inputs, -WATCHED, SHORTEST)
        home = np.array(self.home)[:, None]
        found = np.empty((self.few.arrival.rows, gone.size))
        self.few.arrival.evaluate(np.concatenate([home + gone * (inputs - home), x]), found)
        return gone, found[:-2]

    def _reach(self, inputs: np.ndarray, outputs: Rows, far: np.ndarray) -> None:
        """Fill the results of far poses that parts of the straight way from home lead to."""
        codes = self.few if far.size < _MANY and self.whole is not None else self.many
        if codes.arrival is None:
            return
        given = inputs[:, far]
        gone, x = self._gone(codes, given, 0.0, _SHORTEST_PART)
        there = np.flatnonzero(gone >= 1.0)
        if there.size:
            results = np.empty((self.rows, there.size))
            rows = np.ascontiguousarray(np.concatenate([given, x])[:, there])
            codes.last.evaluate(rows, results)
            _put(outputs, far[there], results)

    def _gone(
        self, codes: StepCodes, given: np.ndarray, least: float, shortest: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """How far straight ways from home lead (N,), and what the last step hands on there.

        A part is gone where it closes, with more than the `least` that says the assembly mode.
        """
        home, start = (np.array(numbers)[:, None] for numbers in (self.home, self.state))
        x, unknowns = np.tile(start, given.shape[1]), self.unknowns
        step, arrival = codes.step, codes.arrival
        assert arrival is not None  # noqa: S101 - of a closure

        def goes(ways: np.ndarray, aim: np.ndarray) -> np.ndarray:
            rows = np.empty((len(home) + len(start), ways.size))
            rows[: len(home)] = home + aim * (given[:, ways] - home)
            # The size of the last step and the contraction begin anew.
            rows[len(home) :] = start
            rows[len(home) : len(home) + unknowns] = x[:unknowns, ways]
            after = np.empty((len(start), ways.size))
            for _ in range(self.most_steps):
                step.evaluate(rows, after)
                rows[len(home) :] = after
            found = np.empty((arrival.rows, ways.size))
            arrival.evaluate(rows, found)
            contracts = after[unknowns + 1] > 0
            kept = contracts & (found[-2] < CLOSED) & (found[-1] > least)
            x[:, ways[kept]] = after[:, kept]
            return kept

        return straight_ways(given.shape[1], goes, shortest), x

    def _loop(self, codes: StepCodes, inputs: np.ndarray, outputs: Rows, threads: int) -> None:
        """Take steps from home, as many as most poses of a chunk need, then fill the results."""

        def fill(part: slice) -> None:
            for where in chunks_of(part, _CHUNK):
                _put(outputs, where, self._after_steps(codes, inputs[:, where]))

        in_shares(fill, inputs.shape[1], threads, _CHUNK)

    def _after_steps(self, codes: StepCodes, inputs: np.ndarray) -> np.ndarray:
        """Results (results, N) after as many steps as most poses need, of others after all."""
        first, step, last = codes.first, codes.step, codes.last
        given, count = inputs.shape
        size = given + self.unknowns  # the row behind the unknowns
        # The state after each step, behind the same inputs: by turns here and there.
        rows, other = np.empty((2, given + len(self.state), count))
        rows[:given] = other[:given] = inputs
        first.evaluate(rows[:given], rows[given:])
        taken = self.first_steps
        while taken < self.most_steps:
            # Those that do not contract arrive nowhere.
            open_poses = np.count_nonzero(~(rows[size] <= _ENOUGH) & (rows[size + 1] > 0))
            if not open_poses or (taken >= self.steps and open_poses <= _LEFT * count):
                break
            step.evaluate(rows, other[given:])
            rows, other, taken = other, rows, taken + 1
        found = np.empty((self.rows, count))
        last.evaluate(rows, found)
        more = np.flatnonzero(~(found[-2] < CLOSED) & (found[-1] > 0))
        if more.size and taken < self.most_steps:
            rows, other = (np.ascontiguousarray(state[:, more]) for state in (rows, other))
            for _ in range(self.most_steps - taken):
                step.evaluate(rows, other[given:])
                rows, other = other, rows
            again = np.empty((self.rows, more.size))
            last.evaluate(rows, again)
            found[:, more] = again
        return found


def _put(outputs: Rows, where: slice | np.ndarray, results: np.ndarray) -> None:
    """Put results at some poses into their rows."""
    for row, values in zip(outputs, results, strict=True):
        row[where] = values


def _arrives(results: Any) -> Any:
    """Where steps arrive in the assembly mode of home (N,): the last two rows say so."""
    return (results[-2] < CLOSED) & (results[-1] > 0)
