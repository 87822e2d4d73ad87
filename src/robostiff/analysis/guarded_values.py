"""Outputs of a kernel from the matrices of the batched form, for poses that it does not answer."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.measures import principal_stiffnesses, worst_deflection
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.where_answered import compliance_where_answered, stiffness_where_answered
from robostiff.compiled import (
    ComplianceMatrix,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
)
from robostiff.errors import InputError


def values_of(output: Output, result: RobotStiffness) -> np.ndarray:
    """Values (N, ...) of an output; not a number where the status or the rank allow none.

    Raises
    ------
    InputError
        For an output that is made of others, such as a derivative.
    """
    match output:
        case StiffnessMatrix():
            return stiffness_where_answered(result)
        case ComplianceMatrix():
            return compliance_where_answered(result)
        case DeflectionUnder():
            return compliance_where_answered(result) @ np.array(output.wrench)
        case WorstDeflection():
            return worst_deflection(compliance_where_answered(result))["worst_deflection"]
        case PrincipalStiffness():
            blocks = principal_stiffnesses(stiffness_where_answered(result))
            return np.concatenate(list(blocks.values()), axis=-1)
    raise InputError("output", got=output.name, expected="an output with a batched form")
