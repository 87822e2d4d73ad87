"""What makes rotations comparable with displacements: a characteristic length, or a metric."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import scaling
from robostiff.errors import InputError
from robostiff.spatial import as_floats

_SHORTEST = 1e-30  # [m]; the largest number there may be is its inverse


def index_length(result: RobotStiffness, length: float | None) -> float:
    """The characteristic length [m]: the one given, or the robot's own at its pose.

    Raises
    ------
    InputError
        For a length that is no positive number, or whose square no stiffness can be divided by.
    """
    if length is None:
        return float(result.about_reference.length)
    expected = f"a length above 0, from {_SHORTEST:.0e} m"
    given = as_floats("characteristic length", length, expected, "m")
    if given.shape != () or not given >= _SHORTEST:
        raise InputError("characteristic length", got=length, expected=expected)
    return float(given)


def length_factors(result: RobotStiffness, length: float) -> np.ndarray:
    """Factors (n,) that turn a twist into lengths: (1, 1, 1, L, L, L) or (1, 1, L)."""
    return scaling(np.array(length), result.space)


def checked_metric(metric: ArrayLike, size: int) -> np.ndarray:
    """A symmetric positive definite matrix (n, n) that measures twists.

    Raises
    ------
    InputError
    """
    expected = f"a symmetric positive definite matrix {size} x {size}, in units 1, m, m^2"
    M = as_floats("metric", metric, expected)
    if M.shape != (size, size):
        raise InputError("metric", got=f"shape {M.shape}", expected=expected)
    sizes = np.sqrt(np.maximum(np.diag(M), 0.0))
    if np.any(np.abs(M - M.T) > 1e-12 * np.outer(sizes, sizes)):
        raise InputError("metric", got=metric, expected=expected, hint="make it symmetric")
    symmetric = 0.5 * (M + M.T)
    if np.any(sizes == 0) or np.linalg.eigvalsh(symmetric / np.outer(sizes, sizes))[0] < 1e-12:
        raise InputError(
            "metric", got=metric, expected=expected, hint="write diag(1, 1, 1, L^2, L^2, L^2)"
        )
    return symmetric
