"""Answers of kernels, and their checks pose by pose."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from robostiff.analysis.answer_of_kernel import CompiledAnswer
from robostiff.analysis.kernel_inputs import InputRows
from robostiff.analysis.measures import values_of
from robostiff.analysis.result import Stiffness
from robostiff.compiled import (
    Backend,
    Kernel,
    Output,
    Rates,
    StiffnessMatrix,
    TotalMass,
    kernel_of,
    room_for,
)
from robostiff.compiled.codes import chunks_of
from robostiff.compiled.machine_code import Rows
from robostiff.elastostatics import Status
from robostiff.elastostatics.conditioning import smallest_held_stiffness
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE, scaling
from robostiff.recorded import CLOSED, Flag, RecordedRobot
from robostiff.spatial import Space

# What is so much clearer than the tolerances ask for is decided alike with the characteristic
# length of another posture, and by wrenches of a record, which are rounded otherwise.
_CLEARLY = 10.0
_ROUNDED = 1e-2
# Part of the largest diagonal entry of K below which rounding shows in the others of its row.
_SMALL = 1e-8


@dataclass(frozen=True)
class RecordedRanks:
    """Decides ranks as `aggregate` does, by unit wrenches of the legs.

    Pivots of K fall with the square of the singular values of these: where they alone are unsafe,
    most poses are near a singular one, but not so near that anything is in doubt.
    """

    kernel: Kernel  # its results are the wrenches that the legs transmit, one after the other
    counts: tuple[int, ...]  # how many each leg has
    space: Space
    length: float  # characteristic length [m]

    @classmethod
    def of(cls, recorded: RecordedRobot) -> RecordedRanks:
        """The ranks of a record that needs no closure."""
        counts = tuple(len(leg.basis) for leg in recorded.legs)
        kernel = kernel_of(recorded, [Wrenches(sum(counts))], Backend.ARRAYS, has_flags=False)
        return cls(kernel, counts, recorded.space, recorded.length)

    def decided(self, inputs: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ranks (N,), and where they are beyond doubt (N,).

        By inputs of the kernels (inputs, N), and K at each pose (N, n, n).
        """
        n, count, tolerance = self.space.size, inputs.shape[1], DEFAULT_TOLERANCE
        s = scaling(np.array(self.length), self.space)
        wrenches = self.kernel.evaluate(inputs).T.reshape(count, sum(self.counts), n) / s
        clear = np.isfinite(wrenches).all(axis=(1, 2))
        wrenches[~clear] = 0.0
        unit = self._unit(wrenches)
        values = np.linalg.svd(unit, compute_uv=False)
        rank = np.count_nonzero(values > tolerance.independence, axis=-1)
        kept = values > _CLEARLY * tolerance.near_independence
        clear &= np.all(kept | (values < _ROUNDED * tolerance.rounding), axis=-1)
        K = K * np.outer(s, s)
        diagonal = np.einsum("nii->ni", K)
        # What no leg feels is zero in both forms, but for the same rounding.
        idle = np.max(np.abs(unit), axis=-1) < _ROUNDED * tolerance.rounding
        shown = diagonal > _SMALL * np.max(diagonal, axis=-1, keepdims=True)
        clear &= np.all(idle | shown, axis=-1)
        smallest = smallest_held_stiffness(K, rank)
        return rank, clear & (smallest > _CLEARLY * tolerance.near_rigidity)

    def _unit(self, wrenches: np.ndarray) -> np.ndarray:
        """An orthonormal basis for each leg, side by side (N, n, m)."""
        ends = np.cumsum(self.counts).tolist()
        found = []
        for own in set(self.counts) - {0}:  # legs with as many wrenches at once
            columns = [
                range(end - m, end) for m, end in zip(self.counts, ends, strict=True) if m == own
            ]
            Q = np.linalg.qr(np.swapaxes(wrenches[:, np.array(columns)], -1, -2))[0]
            found.append(np.moveaxis(Q, 1, 2).reshape(len(Q), self.space.size, -1))
        return np.concatenate(found, axis=-1)


@dataclass(frozen=True)
class Wrenches:
    """So many wrenches that the legs of a robot transmit, as an output of a kernel."""

    count: int
    name = "wrenches"

    def shape(self, space: Space) -> tuple[int, ...]:
        """(count n,)."""
        return (self.count * space.size,)

    def recorded(self, robot: RecordedRobot) -> list[Any]:
        """Their entries, wrench by wrench; world axes, about the reference point."""
        return [x for leg in robot.legs for wrench in leg.basis for x in wrench]


@dataclass(frozen=True)
class AtGeneralPoses:
    """Assumptions of a record."""

    rank: int
    status: Status
    verified: bool  # whether the record is trusted at all
    # Decides the rank near singular poses, of kernels of K alone
    ranks: RecordedRanks | None = field(default=None, kw_only=True)

    def at_one(self, kernel: Kernel, inputs: np.ndarray) -> CompiledAnswer | None:
        """What a kernel of K gives at one pose by inputs (n,); None where a check of it fails."""
        results = kernel.evaluate(inputs[:, None])[:, 0]
        flags, n = int(results[kernel.rows - len(kernel.checks)]), kernel.space.size
        is_right = self.verified and flags in (0, Flag.BEYOND_LIMITS) and closes(kernel, results)
        if not is_right:
            return None
        beyond = Status.BEYOND_LIMITS if flags else Status.OK
        return CompiledAnswer(
            values={StiffnessMatrix.name: results[: n * n].reshape(n, n)},
            status_codes=np.array(int(self.status | beyond), dtype=np.uint16),
            rank=np.array(self.rank, dtype=np.int8),
            guarded=np.array(False),
        )


def decided(
    kernel: Kernel,
    results: Rows,
    values: Mapping[str, np.ndarray],
    given: InputRows,
    general: AtGeneralPoses,
) -> CompiledAnswer:
    """Values, status, rank and guard at each pose; nothing is to be used where ``guarded``.

    By the rows of checks in the results of a kernel. Values of its outputs (N, ...) become no
    numbers where the status says that there is no answer.
    """
    flags = results[kernel.rows - len(kernel.checks)]
    status = np.full(len(flags), int(general.status), dtype=np.uint16)
    rank = np.full(len(flags), general.rank, dtype=np.int8)
    closed = closes(kernel, results)
    guarded = given.loose | ~closed if general.verified else np.ones(len(flags), dtype=bool)
    lost, meet = given.missed, None
    if flags.any():
        codes = flags.astype(np.uint8)
        at = {flag: (codes & np.uint8(flag)) != 0 for flag in Flag}
        status[at[Flag.BEYOND_LIMITS]] |= np.uint16(Status.BEYOND_LIMITS)
        guarded |= at[Flag.DOUBTFUL]
        lost = lost | (closed & at[Flag.OUT_OF_REACH])
        meet = at[Flag.MEETING] & ~lost
        where = np.flatnonzero(~guarded & at[Flag.RANK_DOUBTFUL])
        guarded[where] = True
        if general.ranks is not None and len(where):
            K = values[StiffnessMatrix.name][where]
            rank[where], clear = general.ranks.decided(given.rows[:, where], K)
            guarded[where] = ~clear
            free = np.uint16(Status.FREE_MOTIONS)
            status[where] = (status[where] & ~free) | (rank[where] < kernel.space.size) * free
    if lost.any():
        status[lost], rank[lost] = int(Status.UNREACHABLE), -1
        guarded &= ~lost
        for own in values.values():
            own[lost] = np.nan
    if meet is not None and meet.any():  # eigenvalues have no derivatives where two of them meet
        status[meet] |= np.uint16(Status.ILL_CONDITIONED)
        for output in kernel.outputs:
            if isinstance(output, Rates):
                values[output.name][meet] = np.nan
    return CompiledAnswer(dict(values), status, rank, guarded)


def closes(kernel: Kernel, results: Rows) -> np.ndarray:
    """Where the recorded closure arrives, in the assembly mode of home, as of the results (N,)."""
    if "open" not in kernel.checks:
        return np.broadcast_to(True, np.shape(results[0]))
    return (results[-2] < CLOSED) & (results[-1] > 0)


def attempted(
    kernel: Kernel,
    inputs: InputRows,
    general: AtGeneralPoses,
    threads: int | None,
    out: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> CompiledAnswer:
    """What a kernel answers at rows of inputs; ``guarded`` poses are to be computed again.

    Values of outputs that `out` has arrays (N, ...) for are written there.
    """
    rows, values = _places(kernel, room_for(kernel.rows, len(inputs.missed)), out)
    kernel.evaluate(inputs.rows, rows, threads=threads)
    found = decided(kernel, rows, values, inputs, general)
    for name, own in out.items():
        if values[name] is not own:
            own[...] = values[name]
    return replace(found, values={**values, **out})


def decided_chunks(
    kernel: Kernel, inputs: InputRows, general: AtGeneralPoses, out: Mapping[str, np.ndarray]
) -> Iterator[tuple[slice, CompiledAnswer]]:
    """Which poses, and what a kernel answers there, chunk by chunk in the same memory.

    Values of outputs that `out` has arrays (N, ...) for are written there.
    """
    room = room_for(kernel.rows, min(len(inputs.missed), kernel.chunk))
    for where in chunks_of(slice(0, len(inputs.missed)), kernel.chunk):
        given = InputRows(inputs.rows[:, where], inputs.missed[where], inputs.loose[where])
        here = {name: own[where] for name, own in out.items()}
        rows, values = _places(kernel, room[:, : where.stop - where.start], here)
        kernel.evaluate(given.rows, rows)
        yield where, decided(kernel, rows, values, given, general)


def _places(
    kernel: Kernel, room: np.ndarray, out: Mapping[str, np.ndarray]
) -> tuple[Rows, dict[str, np.ndarray]]:
    """Where a kernel writes its rows at N poses, and the values of its outputs there (N, ...).

    In arrays (N, ...) of some outputs, where they are of float64 with poses side by side, else in
    a room (rows, N).
    """
    rows, values, start = room, dict[str, np.ndarray](), 0
    for output in kernel.outputs:
        shape, own = output.shape(kernel.space), out.get(output.name)
        stop = start + math.prod(shape)
        if own is None or own.dtype != np.float64 or own.strides[0] != own.itemsize:
            own = np.moveaxis(room[start:stop].reshape(*shape, room.shape[1]), -1, 0)
        else:
            entries = np.moveaxis(own, 0, -1)
            rows = [*rows[:start], *(entries[at] for at in np.ndindex(shape)), *rows[stop:]]
        values[output.name], start = own, stop
    return rows, values


def put_direct(
    answer: CompiledAnswer,
    rows: np.ndarray,
    result: Stiffness,
    outputs: Sequence[Output],
    rank: int,
) -> None:
    """Write what the direct form gives at some poses into an answer of a general `rank`."""
    answer.status_codes[rows] = result.status_codes
    answer.rank[rows] = result.rank
    for output in outputs:
        if isinstance(output, TotalMass):
            continue  # no check of the record concerns it
        if isinstance(output, Rates):
            # Derivatives are not recomputed: the loss of digits is reported instead. Where
            # the rank is another, K jumps.
            answer.status_codes[rows] |= np.uint16(Status.ILL_CONDITIONED)
            jumps = ~result.answered | (result.rank != rank)
            answer.values[output.name][rows[jumps]] = np.nan
            continue
        values, of_load = values_of(output, result)
        answer.values[output.name][rows] = values
        answer.status_codes[rows] |= of_load
