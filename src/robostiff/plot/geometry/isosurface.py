"""The surface on which a quantity has a value, by marching tetrahedra.

Each cell of the grid is cut into six tetrahedra around one diagonal; a tetrahedron is crossed by
one triangle or two. Cells with a corner that has no value are left out: the surface ends there.

References
----------
A. Doi, A. Koide: An efficient method of triangulating equi-valued surfaces by using tetrahedral
cells. IEICE Transactions E74-D(1), 1991.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

_CORNERS = np.array(list(product((0, 1), repeat=3)))


def isosurface(
    values: np.ndarray, level: float, axes: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles on which values between the points of a grid are those of a level.

    Parameters
    ----------
    values : (n_x, n_y, n_z) array
        NaN where there is none.
    level : float
    axes : three arrays
        Coordinates of the grid.

    Returns
    -------
    vertices : (m, 3) array
    triangles : (m / 3, 3) array of int

    Examples
    --------
    >>> line = np.linspace(0, 1, 3)
    >>> height = np.broadcast_to(line, (3, 3, 3))
    >>> vertices, _ = isosurface(height, 0.25, (line, line, line))
    >>> set(vertices[:, 2].tolist())
    {0.25}
    """
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    shape = np.array(values.shape) - 1
    corner_values, corner_points = [], []
    for offset in _CORNERS:
        cut = tuple(slice(o, o + n) for o, n in zip(offset, shape, strict=True))
        corner_values.append(values[cut].ravel())
        corner_points.append(grid[cut].reshape(-1, 3))
    v, p = np.stack(corner_values, axis=1), np.stack(corner_points, axis=1)
    crossed = np.isfinite(v).all(axis=1) & (v.min(axis=1) < level) & (v.max(axis=1) >= level)
    v, p = v[crossed], p[crossed]
    triangles = [_crossing(v[:, corners], p[:, corners], level) for corners in _tetrahedra()]
    vertices = np.concatenate([np.zeros((0, 3)), *(t.reshape(-1, 3) for t in triangles)])
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _tetrahedra() -> list[list[int]]:
    """Corners of six tetrahedra: ways along the edges from one end of the diagonal to the other."""
    ways = []
    for order in permutations(range(3)):
        corner = np.zeros(3, dtype=int)
        way = [0]
        for axis in order:
            corner[axis] = 1
            way.append(int(corner @ (4, 2, 1)))
        ways.append(way)
    return ways


def _crossing(v: np.ndarray, p: np.ndarray, level: float) -> np.ndarray:
    """Triangles (k, 3, 3) in which tetrahedra (n, 4) meet the level."""
    order = np.argsort(v, axis=1, kind="stable")
    v = np.take_along_axis(v, order, axis=1)
    p = np.take_along_axis(p, order[..., None], axis=1)
    below = np.count_nonzero(v < level, axis=1)

    def cut(where: np.ndarray, i: int, j: int) -> np.ndarray:
        low, high = v[where, i], v[where, j]
        share = ((level - low) / (high - low))[:, None]
        return p[where, i] + share * (p[where, j] - p[where, i])

    one, two, three = (below == n for n in (1, 2, 3))
    found = [
        np.stack([cut(one, 0, 1), cut(one, 0, 2), cut(one, 0, 3)], axis=1),
        np.stack([cut(three, 0, 3), cut(three, 1, 3), cut(three, 2, 3)], axis=1),
        np.stack([cut(two, 0, 2), cut(two, 0, 3), cut(two, 1, 3)], axis=1),
        np.stack([cut(two, 0, 2), cut(two, 1, 3), cut(two, 1, 2)], axis=1),
    ]
    return np.concatenate(found)
