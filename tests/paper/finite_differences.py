"""Derivatives of frames, from frames alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

AxesAndPoint = tuple[np.ndarray, np.ndarray]

_STEP = 2e-3


def twist_between(now: AxesAndPoint, then: AxesAndPoint, at: np.ndarray) -> np.ndarray:
    """Displacement of the point of a body that is at `at` now, and its small turn."""
    (R, p), (R_then, p_then) = now, then
    moved = p_then + R_then @ R.T @ (at - p)
    turn = R_then @ R.T
    skewed = 0.5 * (turn - turn.T)
    sine = np.array([skewed[2, 1], skewed[0, 2], skewed[1, 0]])
    return np.concatenate([moved - at, sine])


def twist_rate(frame: Callable[[float], AxesAndPoint], at: np.ndarray) -> np.ndarray:
    """Twist of the point `at` per unit of a coordinate, by central differences of fourth order."""
    now = frame(0.0)
    values = [twist_between(now, frame(k * _STEP), at) for k in (-2, -1, 1, 2)]
    return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * _STEP)
