"""Values of a kernel, status and rank from its checks, and the batched form where they fail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.leg_loads import leg_loads, loads_known
from robostiff.analysis.measures import principal_stiffnesses, worst_deflection
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import (
    ComplianceMatrix,
    DeflectionUnder,
    Derivative,
    Kernel,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
    rows_of,
)
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.recorded import CLOSED, SHORT
from robostiff.spatial import Space, move_stiffness, move_twist, move_wrench
from robostiff.spatial.batch import empty_batch

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
    """Assumptions of a record.

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
    """Results of a kernel at some poses.

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
    checks = _checks(kernel, results)
    status = np.full(results.shape[1], int(general.status), dtype=np.uint8)
    rank = np.full(results.shape[1], general.rank, dtype=np.int8)
    if "limits" in checks:
        beyond = checks["limits"] < 0
        if beyond.any():
            status[beyond] |= np.uint8(Status.BEYOND_LIMITS)
    closed = closes(kernel, results)
    guarded = _unsafe(checks, results.shape[1], general) | loose | ~closed
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
            status[meet] |= np.uint8(Status.ILL_CONDITIONED)
            for output in kernel.outputs:
                if isinstance(output, Derivative):
                    rows[output.name][:, meet] = np.nan
    return CheckedResults(rows, status, rank, guarded)


def closes(kernel: Kernel, results: np.ndarray) -> np.ndarray:
    """Where the recorded closure arrives, in the assembly mode of home (N,)."""
    checks = _checks(kernel, results)
    if "open" not in checks:
        return np.ones(results.shape[1], dtype=bool)
    return (checks["open"] < CLOSED) & (checks["mode"] > 0)


def _checks(kernel: Kernel, results: np.ndarray) -> dict[str, np.ndarray]:
    """The rows of checks, which follow those of the outputs."""
    start = kernel.rows - len(kernel.checks)
    return dict(zip(kernel.checks, results[start:], strict=True))


def _unsafe(checks: Mapping[str, np.ndarray], count: int, general: AtGeneralPoses) -> np.ndarray:
    """Where an assumption is close to failing (N,)."""
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


def origin_to_reference(result: RobotStiffness) -> np.ndarray:
    """From the origin of a result to its reference point (N, 3) or (N, 2) [m]."""
    v = result.reference_point - result.origin
    return v if result.space is Space.SPATIAL else v[:, :2]


def stiffness_where_answered(result: RobotStiffness) -> np.ndarray:
    """Stiffness matrices (N, n, n); NaN where there is none."""
    v = origin_to_reference(result)
    K = result.about_reference.matrix
    K = move_stiffness(K, v) if np.any(v) else K
    return _only(result.answered, K)


def compliance_where_answered(result: RobotStiffness) -> np.ndarray:
    """Compliance matrices (N, n, n); NaN where there is none."""
    known = result.has_compliance
    C = empty_batch(known.shape, result.about_reference.matrix.shape[1:])
    C[...] = np.nan
    if np.any(known):
        C[known] = result[known].compliance
    return C


def _only(where: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values with NaN elsewhere."""
    if np.all(where):
        return values
    return np.where(where.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)


def values_of(output: Output, result: RobotStiffness) -> tuple[np.ndarray, np.ndarray]:
    """Values (N, ...) of an output, and where a load of its own drives a free motion (N,).

    Not a number where there are none, which the status explains.
    """
    balanced = np.zeros(result.batch_shape, dtype=bool)
    match output:
        case StiffnessMatrix():
            return stiffness_where_answered(result), balanced
        case ComplianceMatrix():
            return compliance_where_answered(result), balanced
        case DeflectionUnder():
            return twists_under(result, np.array(output.wrench))
        case WorstDeflection():
            worst = worst_deflection(compliance_where_answered(result))["worst_deflection"]
            return worst, balanced
        case PrincipalStiffness():
            blocks = principal_stiffnesses(stiffness_where_answered(result))
            return np.concatenate(list(blocks.values()), axis=-1), balanced
    raise InputError("output", got=output.name, expected="an output with a batched form")


def twists_under(result: RobotStiffness, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twists of the reference point under a wrench, and where the load drives a free motion.

    The least displacement, where free motions remain that the load does not feel.

    Parameters
    ----------
    result : RobotStiffness
        At N poses.
    wrench : (n,) array
        About the reference point [N, N m].

    Returns
    -------
    twist : (N, n) array
        [m, rad]; NaN where there is none.
    unbalanced : (N,) array of bool
    """
    twist = np.einsum("...ij,j->...i", compliance_where_answered(result), wrench)
    unbalanced = np.zeros(len(twist), dtype=bool)
    rows = np.flatnonzero(loads_known(result) & np.isnan(twist[:, 0]))
    if len(rows):
        to_origin = -origin_to_reference(result)[rows]
        F = move_wrench(np.broadcast_to(wrench, (len(rows), len(wrench))), to_origin)
        loads = leg_loads(result[rows], F)
        if loads is not None:
            t = np.where(loads.balanced[:, None], loads.twist, np.nan)
            twist[rows], unbalanced[rows] = move_twist(t, -to_origin), ~loads.balanced
    return twist, unbalanced
