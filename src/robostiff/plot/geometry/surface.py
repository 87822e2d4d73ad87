"""Surfaces of ellipsoids, bounded or not, as triangles."""

from __future__ import annotations

import numpy as np

_AROUND, _ALONG = 33, 17


def ellipsoid_mesh(
    half_axes: np.ndarray, open_axes: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Surface of an ellipsoid around the origin.

    Parameters
    ----------
    half_axes : (3, 3) array
        Rows: half axes as vectors. A zero row makes it flat.
    open_axes : tuple of int
        Axes without a limit, of which the half axis says how much is shown: one makes a tube, two
        make a pair of plates.

    Returns
    -------
    vertices : (n, 3) array
    triangles : (m, 3) array of int

    Examples
    --------
    >>> vertices, _ = ellipsoid_mesh(np.diag([3.0, 2.0, 1.0]))
    >>> np.abs(vertices).max(axis=0).round(2).tolist()
    [3.0, 2.0, 1.0]
    """
    closed = [i for i in range(3) if i not in open_axes]
    angle = np.linspace(0, 2 * np.pi, _AROUND)
    if len(open_axes) == 1:
        along = np.linspace(-1, 1, _ALONG)
        a, b = np.meshgrid(angle, along, indexing="ij")
        places = [(closed[0], np.cos(a)), (closed[1], np.sin(a)), (open_axes[0], b)]
    elif len(open_axes) == 2:
        return _plates(half_axes, closed[0], open_axes)
    else:
        a, b = np.meshgrid(angle, np.linspace(0, np.pi, _ALONG), indexing="ij")
        places = [(0, np.cos(a) * np.sin(b)), (1, np.sin(a) * np.sin(b)), (2, np.cos(b))]
    vertices = sum(value[..., None] * half_axes[i] for i, value in places)
    return np.reshape(vertices, (-1, 3)), _grid_triangles(*a.shape)


def _plates(
    half_axes: np.ndarray, closed: int, open_axes: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    u, v = (half_axes[i] for i in open_axes)
    corners = np.array([-u - v, u - v, u + v, -u + v])
    plates = np.concatenate([corners + half_axes[closed], corners - half_axes[closed]])
    one = np.array([[0, 1, 2], [0, 2, 3]])
    return plates, np.concatenate([one, one + 4])


def _grid_triangles(rows: int, columns: int) -> np.ndarray:
    """Triangles of a grid of points."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + columns, corner + 1], axis=-1)
    upper = np.stack([corner + 1, corner + columns, corner + columns + 1], axis=-1)
    return np.concatenate([lower, upper])
