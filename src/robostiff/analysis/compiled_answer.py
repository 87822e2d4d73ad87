"""The answer of a compiled robot or linkage: a kernel's, pose by pose, and the careful form's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.guarded_values import (
    AtGeneralPoses,
    CheckedResults,
    checked_results,
    values_of,
)
from robostiff.analysis.kernel_inputs import InputRows
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import Derivative, Kernel, Output, unpack
from robostiff.compiled.kernel import POSES_A_CHUNK, chunks_of, in_shares
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.spatial.batch import empty_batch


@dataclass(frozen=True, repr=False)
class CompiledAnswer:
    """The result of a compiled robot at a batch of poses.

    Attributes
    ----------
    values : dict of names to (N, ...) arrays
        One array an output; not a number where the status says that there is no answer.
    status_codes : (N,) array of uint8
        See `Status`.
    rank : (N,) array of int8
        -1 where out of reach.
    guarded : (N,) array of bool
        Poses that were computed again by the wrench basis form on batches.
    """

    values: dict[str, np.ndarray]
    status_codes: np.ndarray
    rank: np.ndarray
    guarded: np.ndarray

    def __repr__(self) -> str:
        names = ", ".join(self.values)
        share = f"{self.guarded_share:.2%} recomputed"
        return f"<CompiledAnswer of {len(self.rank)} poses: {names}; {share}>"

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were recomputed."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0


def attempted(
    kernel: Kernel, inputs: InputRows, general: AtGeneralPoses, threads: int
) -> CompiledAnswer:
    """What a kernel answers at rows of inputs; ``guarded`` poses are to be computed again."""
    count = len(inputs.missed)
    answer = CompiledAnswer(
        values={
            output.name: empty_batch((count,), output.shape(kernel.space))
            for output in kernel.outputs
        },
        status_codes=np.empty(count, dtype=np.uint8),
        rank=np.empty(count, dtype=np.int8),
        guarded=np.empty(count, dtype=bool),
    )

    def fill(part: slice) -> None:
        for where, found in checked_chunks(kernel, inputs, general, part):
            for name, values in answer.values.items():
                unpack(found.rows[name], values[where])
            answer.status_codes[where] = found.status_codes
            answer.rank[where] = found.rank
            answer.guarded[where] = found.guarded

    in_shares(fill, count, threads)
    return answer


def checked_chunks(
    kernel: Kernel, inputs: InputRows, general: AtGeneralPoses, part: slice
) -> Iterator[tuple[slice, CheckedResults]]:
    """Which poses, and checked results at them; each chunk takes the place of the one before."""
    buffer = np.empty((kernel.rows, min(POSES_A_CHUNK, part.stop - part.start)))
    for where in chunks_of(part):
        count = where.stop - where.start
        room = buffer if count == buffer.shape[1] else np.empty((len(buffer), count))
        results = kernel.evaluate(inputs.rows[:, where], room)
        missed, loose = inputs.missed[where], inputs.loose[where]
        yield where, checked_results(kernel, results, missed, loose, general)


def put_careful(
    answer: CompiledAnswer,
    rows: np.ndarray,
    result: RobotStiffness,
    outputs: Sequence[Output],
    rank: int,
) -> None:
    """Write what the careful form gives at some poses into an answer of a general `rank`."""
    answer.status_codes[rows] = result.status_codes
    answer.rank[rows] = result.rank
    for output in outputs:
        if isinstance(output, Derivative):
            # Derivatives are not recomputed: the loss of digits is reported instead. Where
            # the rank is another, K jumps.
            answer.status_codes[rows] |= np.uint8(Status.ILL_CONDITIONED)
            jumps = ~result.answered | (result.rank != rank)
            answer.values[output.name][rows[jumps]] = np.nan
            continue
        values, unbalanced = values_of(output, result)
        answer.values[output.name][rows] = values
        answer.status_codes[rows] |= unbalanced * np.uint8(Status.UNBALANCED)


def checked_outputs(outputs: Sequence[Output]) -> tuple[Output, ...]:
    """Outputs to compile, as they were given.

    Raises
    ------
    InputError
        When there is none, one is no output, or two have the same name.
    """
    kinds = "StiffnessMatrix(), PrincipalStiffness()"
    if not isinstance(outputs, Sequence) or not outputs:
        raise InputError(
            "outputs to compile", got=outputs, expected="several", hint=f"write [{kinds}]"
        )
    for output in outputs:
        if isinstance(output, type) or not isinstance(output, Output):
            raise InputError("output to compile", got=output, expected=f"such as {kinds}")
    names = [output.name for output in outputs]
    if len(set(names)) < len(names):
        raise InputError(
            "outputs to compile",
            got=names,
            expected="each name once",
            hint="compile once for each load case",
        )
    return tuple(outputs)
