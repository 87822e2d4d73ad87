"""Eq. (27) and (28) entry by entry, in numbers and in symbols."""

from __future__ import annotations

from typing import Any

import numpy as np


def entries27(R: Any, r: Any, h: Any) -> list[list[Any]]:
    """Case A: K L^2 / (3 K11), with L^2 = (R - r)^2 + h^2."""
    d = R - r
    return _entries(d * d, d, 0 * d, r, h)


def entries28(R: Any, r: Any, h: Any) -> list[list[Any]]:
    """Case B: K L^2 / (3 K11), with L^2 = R^2 - R r + r^2 + h^2."""
    return _entries((R - r) ** 2 + R * r, R / 2 - r, 3 * r * r * R * R / 2, r, h)


def eq27(K11: float, R: float, r: float, h: float) -> np.ndarray:
    """K of case A."""
    return 3 * K11 / ((R - r) ** 2 + h * h) * np.array(entries27(R, r, h))


def eq28(K11: float, R: float, r: float, h: float) -> np.ndarray:
    """K of case B."""
    return 3 * K11 / (R * R - R * r + r * r + h * h) * np.array(entries28(R, r, h))


def _entries(side: Any, d: Any, last: Any, r: Any, h: Any) -> list[list[Any]]:
    turn, coupling = r * r * h * h, r * h * d
    return [
        [side, 0, 0, 0, coupling, 0],
        [0, side, 0, -coupling, 0, 0],
        [0, 0, 2 * h * h, 0, 0, 0],
        [0, -coupling, 0, turn, 0, 0],
        [coupling, 0, 0, 0, turn, 0],
        [0, 0, 0, 0, 0, last],
    ]
