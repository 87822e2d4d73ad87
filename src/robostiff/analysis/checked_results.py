"""Results of a kernel with what its checks say of them: status, rank, and whom not to trust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.compiled import Derivative, Kernel, rows_of
from robostiff.elastostatics import Status
from robostiff.recorded import SHORT

# Losses of the recorded pivots above which a pose is computed again; their squares are summed. The
# record loses about as many digits as a loss has, and several one after the other more. Stiffness
# falls with the square of the wrenches that hold it: of those, at most a hundredth is lost.
_SAFE = 1e4**2
_OUT_OF_REACH = -1e-3  # of `RecordedRobot.reach`: certainly out of reach
# An actuator nearer to a limit than this part of its range is looked at again.
_AT_LIMIT = 1e-9
# A gap between eigenvalues, as a part of them, below which their derivatives are rounding.
_APART = 1e-7


@dataclass(frozen=True)
class AtGeneralPoses:
    """What a record takes for granted.

    Attributes
    ----------
    rank : int
    status : Status
    verified : bool
        Whether the record is trusted at all.
    """

    rank: int
    status: Status
    verified: bool


@dataclass(frozen=True)
class CheckedResults:
    """What a kernel says of some poses.

    Attributes
    ----------
    rows : dict of names to (rows, N) arrays
        Those of each output, not a number where the status says that there is no answer; views of
        the results.
    status_codes : (N,) array of uint8
    rank : (N,) array of int8
    guarded : (N,) array of bool
        Where nothing of this is to be used.
    """

    rows: dict[str, np.ndarray]
    status_codes: np.ndarray
    rank: np.ndarray
    guarded: np.ndarray


def checked_results(
    kernel: Kernel,
    results: np.ndarray,
    missed: np.ndarray,
    loose: np.ndarray,
    general: AtGeneralPoses,
) -> CheckedResults:
    """Rows by output, with status, rank and guard at each pose.

    Parameters
    ----------
    kernel : Kernel
    results : (rows, N) array
        Of the kernel; changed where there is no answer.
    missed : (N,) array of bool
        Poses that are known to be out of reach.
    loose : (N,) array of bool
        Poses whose inputs are not to be trusted.
    general : AtGeneralPoses
    """
    rows, start = {}, 0
    for output in kernel.outputs:
        stop = start + rows_of(output.shape(kernel.space))
        rows[output.name] = results[start:stop]
        start = stop
    checks = dict(zip(kernel.checks, results[start:], strict=True))
    status = np.full(results.shape[1], int(general.status), dtype=np.uint8)
    rank = np.full(results.shape[1], general.rank, dtype=np.int8)
    if "limits" in checks:
        beyond = checks["limits"] < 0
        if beyond.any():
            status[beyond] |= np.uint8(Status.BEYOND_LIMITS)
    guarded = _unsafe(checks, results.shape[1], general) | loose
    out_of_reach = missed
    if "reach" in checks:
        out_of_reach = out_of_reach | (checks["reach"] < _OUT_OF_REACH)
    lost = bool(out_of_reach.any())
    if lost:
        status[out_of_reach], rank[out_of_reach] = int(Status.UNREACHABLE), -1
        guarded &= ~out_of_reach
        results[:start, out_of_reach] = np.nan
    if "gap" in checks:  # eigenvalues have no derivatives where two of them meet
        meet = ~(checks["gap"] > _APART) & ~out_of_reach
        if meet.any():
            status[meet] |= np.uint8(Status.ILL_CONDITIONED)
            for output in kernel.outputs:
                if isinstance(output, Derivative):
                    rows[output.name][:, meet] = np.nan
    return CheckedResults(rows, status, rank, guarded)


def _unsafe(checks: Mapping[str, np.ndarray], count: int, general: AtGeneralPoses) -> np.ndarray:
    """Where a margin is nearly used up (N,)."""
    if not general.verified:
        return np.ones(count, dtype=bool)
    safe = np.isfinite(checks["trace"])
    for name in {"loss", "rank"} & checks.keys():
        safe &= checks[name] < _SAFE
    if "reach" in checks:
        safe &= checks["reach"] > SHORT
    if "limits" in checks:
        safe &= np.abs(checks["limits"]) > _AT_LIMIT
    return ~safe
