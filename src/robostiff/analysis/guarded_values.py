"""Outputs of a kernel from the matrices of the batched form, for poses that it does not answer."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.leg_loads import leg_loads, loads_known
from robostiff.analysis.measures import principal_stiffnesses, worst_deflection
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.where_answered import (
    compliance_where_answered,
    origin_to_reference,
    stiffness_where_answered,
)
from robostiff.compiled import (
    ComplianceMatrix,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
)
from robostiff.errors import InputError
from robostiff.spatial import move_twist, move_wrench


def values_of(output: Output, result: RobotStiffness) -> tuple[np.ndarray, np.ndarray]:
    """Values (N, ...) of an output, and where a load of its own drives a free motion (N,).

    Not a number where there are none, which the status explains.

    Raises
    ------
    InputError
        For an output that is made of others, such as a derivative.
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
