"""Answers of kernels, and their checks pose by pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.analysis.kernel_inputs import InputRows
from robostiff.analysis.measures import values_of
from robostiff.analysis.result import Stiffness
from robostiff.compiled import (
    Backend,
    Checks,
    Kernel,
    Output,
    Rates,
    StiffnessMatrix,
    TotalMass,
    kernel_of,
    rows_of,
    unpack,
)
from robostiff.compiled.codes import POSES_A_CHUNK, chunks_of, in_shares
from robostiff.elastostatics import Status
from robostiff.elastostatics.batched import PoseBatch
from robostiff.elastostatics.conditioning import smallest_held_stiffness
from robostiff.elastostatics.status import StatusOfPoses
from robostiff.elastostatics.tolerance import DEFAULT_TOLERANCE, scaling
from robostiff.recorded import CLOSED, SHORT, RecordedRobot
from robostiff.spatial import Space
from robostiff.spatial.batch import empty_batch

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
        kernel = kernel_of(recorded, [_Wrenches(sum(counts))], Backend.ARRAYS, checks=Checks.NONE)
        return cls(kernel, counts, recorded.space, recorded.length)

    def decided(self, inputs: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ranks (N,), and where they are beyond doubt (N,).

        By inputs of the kernels (inputs, N), and the upper triangle of K at each pose (rows, N).
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
        K = empty_batch((count,), (n, n))
        unpack(upper, K)
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
class _Wrenches:
    """So many wrenches that the legs of a robot transmit, as an output of a kernel."""

    count: int
    name = "wrenches"

    def shape(self, space: Space) -> tuple[int, ...]:
        """(count n,)."""
        return (self.count * space.size,)

    def recorded(self, robot: RecordedRobot) -> list[Any]:
        """Their entries, wrench by wrench; world axes, about the reference point."""
        return [x for leg in robot.legs for wrench in leg.basis for x in wrench]


# Losses of the recorded pivots above which a pose is computed again; their squares are summed. The
# record loses about as many digits as a loss has, and several one after the other more. Stiffness
# falls with the square of the wrenches that hold it: of those, at most a hundredth is lost.
_SAFE = 1e4**2
_OUT_OF_REACH = -1e-3  # of `RecordedRobot.reach`: certainly out of reach
# An actuator nearer to a limit than this part of its range is looked at again.
_AT_LIMIT = 1e-9
# A gap between eigenvalues, as a part of them, below which their derivatives are rounding.
_APART = 1e-7


def _places(space: Space) -> np.ndarray:
    """Rows of a kernel in which the entries of a symmetric matrix (n, n) are."""
    shape = (space.size, space.size)
    found = np.empty((1, *shape), dtype=int)
    unpack(np.arange(rows_of(shape))[:, None], found)
    return found[0]


_PLACES = {space: _places(space) for space in Space}


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
        results = kernel.evaluate(inputs[:, None])[:, 0].tolist()
        start = kernel.rows - len(kernel.checks)
        checks = dict(zip(kernel.checks, results[start:], strict=True))
        if not (_is_regular(checks, self) and _closes(checks) and checks.get("rank", 0.0) < _SAFE):
            return None
        beyond = Status.BEYOND_LIMITS if checks.get("limits", 0.0) < 0 else Status.OK
        return CompiledAnswer(
            values={StiffnessMatrix.name: np.array(results)[_PLACES[kernel.space]]},
            status_codes=np.array(int(self.status | beyond), dtype=np.uint16),
            rank=np.array(self.rank, dtype=np.int8),
            guarded=np.array(False),
        )


@dataclass(frozen=True)
class CheckedResults:
    """Results of a kernel at some poses."""

    # dict of names to (rows, N): those of each output, not a number where the status says that
    # there is no answer; views of the results
    rows: dict[str, np.ndarray]
    status_codes: np.ndarray  # (N,) of uint16
    rank: np.ndarray  # (N,) of int8
    guarded: np.ndarray  # (N,) of bool: where nothing of this is to be used


def checked_results(
    kernel: Kernel,
    results: np.ndarray,
    missed: np.ndarray,
    loose: np.ndarray,
    general: AtGeneralPoses,
    inputs: np.ndarray | None = None,
) -> CheckedResults:
    """Rows by output, with status, rank and guard at each pose.

    Results (rows, N) of the kernel are changed where there is no answer. Poses that are `missed`
    (N,) are known to be out of reach, inputs of `loose` ones (N,) are not to be trusted. Inputs
    (inputs, N) of the kernel are given where ranks may be decided by them.
    """
    rows, start = {}, 0
    for output in kernel.outputs:
        stop = start + rows_of(output.shape(kernel.space))
        rows[output.name] = results[start:stop]
        start = stop
    checks = _checks(kernel, results)
    status = np.full(results.shape[1], int(general.status), dtype=np.uint16)
    rank = np.full(results.shape[1], general.rank, dtype=np.int8)
    if "limits" in checks:
        beyond = checks["limits"] < 0
        if beyond.any():
            status[beyond] |= np.uint16(Status.BEYOND_LIMITS)
    closed = _closes(checks) & np.ones(results.shape[1], dtype=bool)
    guarded = ~(closed & _is_regular(checks, general)) | loose
    where = np.flatnonzero(~guarded & ~(checks["rank"] < _SAFE)) if "rank" in checks else ()
    if len(where):
        guarded[where] = True
        if general.ranks is not None and inputs is not None:
            rank[where], clear = general.ranks.decided(inputs[:, where], results[:start, where])
            guarded[where] = ~clear
            free = np.uint16(Status.FREE_MOTIONS)
            status[where] = (status[where] & ~free) | (rank[where] < kernel.space.size) * free
    out_of_reach = missed
    if "reach" in checks:
        out_of_reach = out_of_reach | (closed & (checks["reach"] < _OUT_OF_REACH))
    lost = bool(out_of_reach.any())
    if lost:
        status[out_of_reach], rank[out_of_reach] = int(Status.UNREACHABLE), -1
        guarded &= ~out_of_reach
        results[:start, out_of_reach] = np.nan
    if "gap" in checks:  # eigenvalues have no derivatives where two of them meet
        meet = ~(checks["gap"] > _APART) & ~out_of_reach
        if meet.any():
            status[meet] |= np.uint16(Status.ILL_CONDITIONED)
            for output in kernel.outputs:
                if isinstance(output, Rates):
                    rows[output.name][:, meet] = np.nan
    return CheckedResults(rows, status, rank, guarded)


def closes(kernel: Kernel, results: np.ndarray) -> np.ndarray:
    """Where the recorded closure arrives, in the assembly mode of home (N,)."""
    return _closes(_checks(kernel, results)) & np.ones(results.shape[1], dtype=bool)


def _checks(kernel: Kernel, results: np.ndarray) -> dict[str, np.ndarray]:
    """The rows of checks, which follow those of the outputs."""
    start = kernel.rows - len(kernel.checks)
    return dict(zip(kernel.checks, results[start:], strict=True))


# Checks are rows of numbers (N,) or, at one pose, numbers.


def _closes(checks: Mapping[str, Any]) -> Any:
    return "open" not in checks or (checks["open"] < CLOSED) & (checks["mode"] > 0)


def _is_regular(checks: Mapping[str, Any], general: AtGeneralPoses) -> Any:
    """Where no assumption is close to failing, that of the rank left out."""
    safe = np.isfinite(checks["trace"]) & general.verified
    if "loss" in checks:
        safe = safe & (checks["loss"] < _SAFE)
    if "reach" in checks:
        safe = safe & (checks["reach"] > SHORT)
    if "limits" in checks:
        safe = safe & (abs(checks["limits"]) > _AT_LIMIT)
    return safe


@dataclass(frozen=True, repr=False)
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
        return f"<CompiledAnswer of {len(self.rank)} poses: {names}; {share}>"

    @property
    def matrix(self) -> np.ndarray:
        """Stiffness matrices (N, n, n), of a kernel that has them."""
        return self.values[StiffnessMatrix.name]

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
        status_codes=np.empty(count, dtype=np.uint16),
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
        rows, missed, loose = inputs.rows[:, where], inputs.missed[where], inputs.loose[where]
        results = kernel.evaluate(rows, room)
        yield where, checked_results(kernel, results, missed, loose, general, rows)


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
