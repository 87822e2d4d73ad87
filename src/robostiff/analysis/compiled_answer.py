"""Answers of kernels at poses, and their checks pose by pose; a kernel from disk needs no more."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.compiled import ArrayCode, Kernel, Rates, StiffnessMatrix, room_for
from robostiff.compiled.codes import Rows, chunks_of
from robostiff.elastostatics import Status
from robostiff.elastostatics.status import PoseBatch, StatusOfPoses
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE, scaling, smallest_held_stiffness
from robostiff.frozen import field, frozen, replace
from robostiff.record import CLOSED, Flag, Program
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.recorded import RecordedRobot

# What is so much clearer than the tolerances ask for is decided alike with the characteristic
# length of another posture, and by wrenches of a record, which are rounded otherwise.
_CLEARLY = 10.0
_ROUNDED = 1e-2
# Part of the largest diagonal entry of K below which rounding shows in the others of its row.
_SMALL = 1e-8
# What flags say of a pose that has an answer.
_SAID = {
    Flag.BEYOND_LIMITS: np.uint16(Status.BEYOND_LIMITS),
    Flag.UNTENSIONED: np.uint16(Status.UNTENSIONED),
    Flag.UNBALANCED: np.uint16(Status.UNBALANCED),
}


@frozen
class InputRows:
    """Inputs of a kernel at N poses."""

    rows: np.ndarray  # (inputs, N)
    missed: np.ndarray  # (N,) of bool: poses that are known to be out of reach
    # (N,) of bool: poses within reach whose legs do not meet the platform to the last digits, or
    # do not follow from the pose
    loose: np.ndarray


@frozen(repr=False)
class CompiledAnswer(StatusOfPoses, PoseBatch):
    """The result of a compiled robot at a batch of poses.

    Attributes
    ----------
    values : dict of names to (N, ...) arrays
        One array an output; not a number where the status says that there is no answer.
    status_codes : (N,) array of uint16
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
        return f"<CompiledAnswer of {self.rank.size} poses: {names}; {share}>"

    @property
    def matrix(self) -> np.ndarray:
        """Stiffness matrices (N, n, n), of a kernel that has them."""
        return self.values[StiffnessMatrix.name]

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were recomputed."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0

    def put_out_of_reach(self, rows: np.ndarray, status: Status = Status.UNREACHABLE) -> None:
        """Say of some poses that they are out of reach, or have no tensions, in place."""
        self.status_codes[rows], self.rank[rows] = int(status), -1
        self.guarded[rows] = False
        for own in self.values.values():
            own[rows] = np.nan


@frozen
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
        counts, record = tuple(len(leg.basis) for leg in recorded.legs), recorded.record
        entries = [x for leg in recorded.legs for wrench in leg.basis for x in wrench]
        code = ArrayCode(Program.of(record, entries))
        kernel = Kernel(record.inputs, (), (), recorded.space, code)
        return cls(kernel, counts, recorded.space, recorded.length)

    def at(self, inputs: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ranks (N,), and where they are beyond doubt (N,).

        By inputs of the kernels (inputs, N), and K at each pose (N, n, n).
        """
        n, count, tolerance = self.space.size, inputs.shape[1], DEFAULT_TOLERANCE
        s = scaling(np.array(self.length), self.space)
        wrenches = self.kernel.evaluate(inputs).T.reshape(count, sum(self.counts), n) / s
        clear = np.isfinite(wrenches).all(axis=(1, 2))
        wrenches[~clear] = 0.0
        ends, bases = np.cumsum(self.counts).tolist(), []
        for own in set(self.counts) - {0}:  # of legs with as many wrenches at once
            sizes = zip(self.counts, ends, strict=True)
            columns = [range(end - m, end) for m, end in sizes if m == own]
            Q = np.linalg.qr(np.swapaxes(wrenches[:, np.array(columns)], -1, -2))[0]
            bases.append(np.moveaxis(Q, 1, 2).reshape(count, n, -1))
        unit = np.concatenate(bases, axis=-1)  # an orthonormal basis for each leg (N, n, m)
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


@frozen
class AtGeneralPoses:
    """Assumptions of a record."""

    rank: int
    status: Status
    verified: bool  # whether the record is trusted at all
    # Decides the rank near singular poses, of kernels of K alone
    ranks: RecordedRanks | None = field(default=None, kw_only=True)


def answer_of_results(
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
    lost, meet, slack = given.missed, None, None
    if not flags.max(initial=0.0) <= 0:
        codes = flags.astype(np.uint8)
        at = {flag: (codes & np.uint8(flag)) != 0 for flag in Flag}
        for flag, own in _SAID.items():
            status[at[flag]] |= own
        guarded |= at[Flag.DOUBTFUL]
        lost, slack = lost | (closed & at[Flag.OUT_OF_REACH]), at[Flag.INFEASIBLE]
        meet = at[Flag.MEETING] & ~lost
        where = np.flatnonzero(~guarded & at[Flag.RANK_DOUBTFUL])
        guarded[where] = True
        if general.ranks is not None and len(where):
            K = values[StiffnessMatrix.name][where]
            rank[where], clear = general.ranks.at(given.rows[:, where], K)
            guarded[where] = ~clear
            free = np.uint16(Status.FREE_MOTIONS)
            status[where] = (status[where] & ~free) | (rank[where] < kernel.space.size) * free
    answer = CompiledAnswer(dict(values), status, rank, guarded)
    answer.put_out_of_reach(lost)
    if slack is not None and general.verified:
        answer.put_out_of_reach(slack, Status.INFEASIBLE)
    if meet is not None and meet.any():  # eigenvalues have no derivatives where two of them meet
        status[meet] |= np.uint16(Status.ILL_CONDITIONED)
        for output in kernel.outputs:
            if isinstance(output, Rates):
                values[output.name][meet] = np.nan
    return answer


def closes(kernel: Kernel, results: Any) -> Any:
    """Where the recorded closure arrives, in the assembly mode of home, as of the results (N,)."""
    if "open" not in kernel.checks:  # nothing needs to be closed
        return np.ones(np.shape(results[-1]), dtype=bool)
    return (results[-2] < CLOSED) & (results[-1] > 0)


def answer_of_kernel(
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
    found = answer_of_results(kernel, rows, values, inputs, general)
    for name, own in out.items():
        if values[name] is not own:
            own[...] = values[name]
    return replace(found, values={**values, **out})


def answers_in_chunks(
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
        yield where, answer_of_results(kernel, rows, values, given, general)


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
            entries: Any = [np.moveaxis(own, 0, -1)]
            for _ in shape:
                entries = chain.from_iterable(entries)
            rows = [*rows[:start], *entries, *rows[stop:]]
        values[output.name], start = own, stop
    return rows, values
