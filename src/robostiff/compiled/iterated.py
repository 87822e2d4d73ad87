"""Newton steps as a loop over one compiled step, and what follows them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from robostiff.compiled.arrays import ArrayCode
from robostiff.compiled.machine import MachineCode
from robostiff.record import Program
from robostiff.recorded import RecordedClosure

# Poses at once: their inputs and unknowns should stay in the second-level cache.
_CHUNK = 512


@dataclass(frozen=True)
class IteratedCode:
    """Runs the steps of a closure one after the other, then a program at its end; picklable.

    Attributes
    ----------
    closure : RecordedClosure
    step : MachineCode or ArrayCode
        One step.
    last : MachineCode or ArrayCode
        What follows, from the inputs of the closure and what the steps hand on.
    """

    closure: RecordedClosure
    step: MachineCode | ArrayCode
    last: MachineCode | ArrayCode

    @classmethod
    def of(
        cls,
        closure: RecordedClosure,
        program: Program,
        code: Callable[[Program], MachineCode | ArrayCode],
    ) -> IteratedCode:
        """The code of a program of leg coordinates, run at poses."""
        return cls(closure, code(closure.step), code(closure.arrived(program)))

    @property
    def operations(self) -> int:
        """Number of operations, those of all steps counted."""
        return self.closure.steps * self.step.operations + self.last.operations

    @property
    def rows(self) -> int:
        """Number of results."""
        return self.last.rows

    def evaluate(self, inputs: np.ndarray, outputs: np.ndarray, threads: int = 1) -> None:
        """Fill `outputs` (results, N) from `inputs` (inputs, N), float64."""
        count = inputs.shape[1]
        # Whole chunks for each thread, so that no bit depends on their number.
        share = max(1, -(-count // (_CHUNK * threads))) * _CHUNK
        parts = [slice(start, min(start + share, count)) for start in range(0, count, share)]
        if len(parts) <= 1:
            self._fill(inputs, outputs, slice(0, count))
            return
        with ThreadPoolExecutor(len(parts)) as pool:
            for done in [pool.submit(self._fill, inputs, outputs, part) for part in parts]:
                done.result()

    def _fill(self, inputs: np.ndarray, outputs: np.ndarray, part: slice) -> None:
        given, start = len(inputs), np.array([*self.closure.state.values()])[:, None]
        for first in range(part.start, part.stop, _CHUNK):
            where = slice(first, min(first + _CHUNK, part.stop))
            rows = np.empty((given + len(start), where.stop - first))
            after = np.empty((len(start), where.stop - first))
            rows[:given], rows[given:] = inputs[:, where], start
            for _ in range(self.closure.steps):
                self.step.evaluate(rows, after)
                rows[given:] = after
            found = np.empty((self.rows, where.stop - first))
            self.last.evaluate(rows, found)
            outputs[:, where] = found
