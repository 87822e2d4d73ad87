"""A plate through points."""

from __future__ import annotations

import numpy as np

_SAME = 1e-6


def plate(points: np.ndarray) -> np.ndarray | None:
    """Points (n, 3) in the order in which they go around; None where they span no area.

    Examples
    --------
    >>> plate(np.array([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0.0]]))[:, :2].tolist()
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    >>> plate(np.zeros((6, 3))) is None
    True
    """
    away = points - points.mean(axis=0)
    size = np.linalg.norm(away, axis=1).max()
    values, axes = np.linalg.svd(away, full_matrices=True)[1:]
    if len(points) < 3 or values[1] <= _SAME * max(values[0], size):
        return None
    x, y = axes[:2]
    if np.cross(x, y)[np.argmax(np.abs(np.cross(x, y)))] < 0:
        y = -y
    corners = points[np.argsort(np.arctan2(away @ y, away @ x))]
    steps = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return corners[steps > _SAME * size]
