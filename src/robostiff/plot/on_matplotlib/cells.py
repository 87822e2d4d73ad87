"""Cells of a grid: their edges, and regions of them as one hatched patch."""

from __future__ import annotations

import numpy as np
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from robostiff.plot.region_style import RegionStyle


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of cells around values (n,): half-way between them.

    Examples
    --------
    >>> cell_edges(np.array([0.0, 1.0, 3.0])).tolist()
    [-0.5, 0.5, 2.0, 4.0]
    """
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def region_patch(
    x_edges: np.ndarray, y_edges: np.ndarray, where: np.ndarray, style: RegionStyle
) -> PathPatch:
    """Cells (y, x) of a region as one patch, so that its hatching runs through."""
    rectangles = []
    for i, row in enumerate(where):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(int)))
        for start, stop in ends.reshape(-1, 2):
            low, high = y_edges[i], y_edges[i + 1]
            left, right = x_edges[start], x_edges[stop]
            corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
            rectangles.append(Path(corners, closed=True))
    return PathPatch(Path.make_compound_path(*rectangles), **patch_look(style))


def patch_look(style: RegionStyle) -> dict:
    """How Matplotlib draws a region."""
    return {
        "facecolor": "none" if style.fill is None else style.fill,
        "edgecolor": style.line,
        "hatch": style.hatch,
        "linewidth": 0.0,
    }
