"""Principal axes, lines of screws, and surfaces as triangles: ellipsoids, plates, isosurfaces.

Each cell of the grid is cut into six tetrahedra around one diagonal; a tetrahedron is crossed by
one triangle or two. Cells with a corner that has no value are left out: the surface ends there.

References
----------
A. Doi, A. Koide: An efficient method of triangulating equi-valued surfaces by using tetrahedral
cells. IEICE Transactions E74-D(1), 1991.
"""

from __future__ import annotations

from enum import Enum
from itertools import permutations, product

import numpy as np

from robostiff.analysis import CableStiffness, Stiffness
from robostiff.analysis.indices.stiffness_parts import EigenPart, parts_of_cables, stiffness_parts
from robostiff.errors import NoAnswerError
from robostiff.frozen import frozen
from robostiff.spatial import Screw

_AROUND, _ALONG = 33, 17


def ellipsoid_mesh(
    half_axes: np.ndarray, open_axes: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and triangles (m, 3) of an ellipsoid around the origin.

    Rows of `half_axes` (3, 3) are vectors; a zero row makes it flat. Open axes are infinite and
    shown up to the given half axis: one makes a tube, two make a pair of plates.
    """
    closed = [i for i in range(3) if i not in open_axes]
    angle = np.linspace(0, 2 * np.pi, _AROUND)
    if len(open_axes) == 1:
        along = np.linspace(-1, 1, _ALONG)
        a, b = np.meshgrid(angle, along, indexing="ij")
        places = [(closed[0], np.cos(a)), (closed[1], np.sin(a)), (open_axes[0], b)]
    elif len(open_axes) == 2:
        u, v = (half_axes[i] for i in open_axes)
        corners, up = np.array([-u - v, u - v, u + v, -u + v]), half_axes[closed[0]]
        face = np.array([[0, 1, 2], [0, 2, 3]])
        return np.concatenate([corners + up, corners - up]), np.concatenate([face, face + 4])
    else:
        a, b = np.meshgrid(angle, np.linspace(0, np.pi, _ALONG), indexing="ij")
        places = [(0, np.cos(a) * np.sin(b)), (1, np.sin(a) * np.sin(b)), (2, np.cos(b))]
    vertices = np.reshape(sum(v[..., None] * half_axes[i] for i, v in places), (-1, 3))
    n = a.shape[1]  # columns of the grid of points
    corner = (np.arange(len(a) - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower = np.stack([corner, corner + n, corner + 1], axis=-1)
    upper = np.stack([corner + 1, corner + n, corner + n + 1], axis=-1)
    return vertices, np.concatenate([lower, upper])


def perpendicular(e: np.ndarray) -> np.ndarray:
    """A unit vector (3,) across a direction (3,)."""
    across = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
    return across / np.linalg.norm(across)


_SAME = 1e-6


def plate(points: np.ndarray) -> np.ndarray | None:
    """Points (n, 3) in circular order; None if they span no area."""
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


_CORNERS = np.array(list(product((0, 1), repeat=3)))
# corners of six tetrahedra: ways along the edges from one end of a diagonal to the other
_TETRAHEDRA = [[0, a, a + b, 7] for a, b, _ in permutations((4, 2, 1))]


def isosurface(
    values: np.ndarray, level: float, axes: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (m, 3) and triangles (m / 3, 3) on which values on a grid are those of a level.

    Values (n_x, n_y, n_z) are NaN where there is none; `axes` are the coordinates of the grid.
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
    triangles = [_crossing(v[:, corners], p[:, corners], level) for corners in _TETRAHEDRA]
    vertices = np.concatenate([np.zeros((0, 3)), *(t.reshape(-1, 3) for t in triangles)])
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


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
    triangles = [
        np.stack([cut(one, 0, 1), cut(one, 0, 2), cut(one, 0, 3)], axis=1),
        np.stack([cut(three, 0, 3), cut(three, 1, 3), cut(three, 2, 3)], axis=1),
        np.stack([cut(two, 0, 2), cut(two, 0, 3), cut(two, 1, 3)], axis=1),
        np.stack([cut(two, 0, 2), cut(two, 1, 3), cut(two, 1, 2)], axis=1),
    ]
    return np.concatenate(triangles)


AnyStiffness = Stiffness | CableStiffness

_SMALL = 1e-7  # as for descriptions of free motions: a smaller part of a twist is zero


class Quality(Enum):
    """The quantity of an ellipsoid.

    ``COMPLIANCE``
        Displacement under a unit force in every direction; the platform is free to turn.
    ``STIFFNESS``
        Force that a unit displacement in every direction needs; the platform is held from turning.
    ``ROTATIONAL_COMPLIANCE``, ``ROTATIONAL_STIFFNESS``
        The same of rotations and moments: free to shift, held from shifting.
    """

    COMPLIANCE = "translational compliance"
    STIFFNESS = "translational stiffness"
    ROTATIONAL_COMPLIANCE = "rotational compliance"
    ROTATIONAL_STIFFNESS = "rotational stiffness"

    @property
    def is_compliance(self) -> bool:
        """Whether large semi-axes are soft directions."""
        return self in {Quality.COMPLIANCE, Quality.ROTATIONAL_COMPLIANCE}

    @property
    def is_rotational(self) -> bool:
        """Whether it is about rotations and moments."""
        return self in {Quality.ROTATIONAL_COMPLIANCE, Quality.ROTATIONAL_STIFFNESS}

    @property
    def unit(self) -> str:
        """Unit of the semi-axes."""
        if self.is_rotational:
            return "rad/(N m)" if self.is_compliance else "N m/rad"
        return "m/N" if self.is_compliance else "N/m"


_PARTS = {
    Quality.COMPLIANCE: "forces_rotations_free",
    Quality.STIFFNESS: "forces_rotations_held",
    Quality.ROTATIONAL_COMPLIANCE: "moments_translations_free",
    Quality.ROTATIONAL_STIFFNESS: "moments_translations_held",
}


@frozen
class PrincipalAxes:
    """Semi-axes of an ellipsoid, the image of the unit sphere."""

    directions: np.ndarray  # (d, 3): unit vectors, rows
    # (d,): ascending; inf for the compliance of a free direction, 0 for its stiffness
    lengths: np.ndarray

    @property
    def is_free(self) -> np.ndarray:
        """Axes along which motion is free (d,): unlimited compliance, or zero stiffness."""
        return np.isinf(self.lengths) | (self.lengths == 0)


def principal_axes(result: AnyStiffness, quality: Quality) -> PrincipalAxes:
    """Principal axes of one block of the stiffness or the compliance at a single pose.

    Where free motions F t = 0 remain, the compliance is that of the wrenches which do no work on
    them; along the directions that the free motions cover it has no limit.
    """
    if isinstance(result, CableStiffness):
        if quality.is_compliance and result.unstable_motions:
            raise NoAnswerError(f"no compliance of {result.name!r}: the platform does not stay")
        parts = parts_of_cables(result)
    else:
        parts = stiffness_parts(result)
        if quality.is_compliance and parts.rigidity is not None:
            result.required_compliance()  # raises with the reason where no digit holds
    part: EigenPart = getattr(parts, _PARTS[quality])
    rows = [row for row in result.space.rows if (row >= 3) == quality.is_rotational]
    directions, values = part.directions @ np.eye(3)[[row % 3 for row in rows]], part.values
    if not quality.is_compliance:
        return PrincipalAxes(directions, values)
    with np.errstate(divide="ignore"):
        return PrincipalAxes(directions[::-1], 1 / values[::-1])


def length_of(result: AnyStiffness) -> float:
    """The length by which rotations are compared with displacements [m]."""
    if isinstance(result, CableStiffness):
        return float(result.placed.characteristic_length)
    return float(result.length)


_TURN = 1.75 * np.pi
_TURNS_OF_A_SCREW = 2.0
_RADIUS = 0.3  # of half the axis
_STEPS = 96


def screw_line(screw: Screw, near: np.ndarray, half_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Lines that show a screw near a point (3,), with an axis of a half length [m].

    A translation is drawn at the point, an axis where it passes nearest. A helix turns no further
    than its axis is long. Answered are the ends (2, 3) of the axis, and points (n, 3) on the way of
    a point that turns (an arc) or turns and advances (a helix); none of a translation.
    """
    e = screw.axis
    if screw.point is None:
        return near + half_length * np.array([-e, e]), np.zeros((0, 3))
    centre = screw.point + e * (e @ (near - screw.point))
    pitch = screw.pitch or 0.0
    turned = _TURN if pitch == 0 else 2 * np.pi * _TURNS_OF_A_SCREW
    if abs(pitch) * turned > 2 * half_length:
        turned = 2 * half_length / abs(pitch)
    angle = np.linspace(-turned / 2, turned / 2, _STEPS)[:, None]
    across = perpendicular(e)
    around = np.cos(angle) * np.cross(across, e) + np.sin(angle) * across
    around *= _RADIUS * half_length
    return centre + half_length * np.array([-e, e]), centre + around + pitch * angle * e
