"""Outputs of a kernel from the matrices of the batched form, for poses that it does not answer."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.result import RobotStiffness
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
    whole, n = result.about_reference, result.space.size
    K = np.where(result.answered[:, None, None], whole.matrix, np.nan)
    match output:
        case StiffnessMatrix():
            return K
        case ComplianceMatrix():
            return _inverse(K, result.rank)
        case DeflectionUnder():
            return _inverse(K, result.rank) @ np.array(output.wrench)
        case WorstDeflection():
            d = result.space.translations
            C = _inverse(K, result.rank)[:, :d, :d]
            worst = np.full(len(C), np.nan)
            known = np.isfinite(C[:, 0, 0])
            worst[known] = np.linalg.eigvalsh(C[known])[:, -1]
            return worst
        case PrincipalStiffness():
            values = np.full((len(K), n), np.nan)
            rows = result.answered
            d = result.space.translations
            values[rows, :d] = np.linalg.eigvalsh(K[rows, :d, :d])
            values[rows, d:] = np.linalg.eigvalsh(K[rows, d:, d:])
            return values
    raise InputError("output", got=output.name, expected="an output with a batched form")


def _inverse(K: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """K^-1 where K has full rank."""
    C = np.full(K.shape, np.nan)
    full = (rank == K.shape[-1]) & np.isfinite(K[:, 0, 0])
    C[full] = np.linalg.inv(K[full])
    return C
