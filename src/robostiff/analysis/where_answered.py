"""Matrices of a batch of poses about the reference point; not a number where there is none."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.result import RobotStiffness
from robostiff.spatial import Space, move_stiffness
from robostiff.spatial.batch import empty_batch


def origin_to_reference(result: RobotStiffness) -> np.ndarray:
    """From where an answer was computed to its reference point (N, 3) or (N, 2) [m]."""
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
