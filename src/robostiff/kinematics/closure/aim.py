"""Angles of a few axes through one point that point a line, or take up a rotation."""

from __future__ import annotations

import numpy as np

from robostiff.kinematics.turn import turn_about
from robostiff.spatial import cross
from robostiff.spatial.batch import product, transposed

Pair = tuple[np.ndarray, np.ndarray]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)


def angle_between(axis: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Angle about a unit `axis` that brings `start` nearest to `end` (...) [rad].

    Examples
    --------
    >>> angle_between(np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), np.array([0, 2.0, 5.0]))
    np.float64(1.5707963267948966)
    """
    axis = np.broadcast_to(axis, np.broadcast_shapes(axis.shape, start.shape, end.shape))
    start, end = np.broadcast_to(start, axis.shape), np.broadcast_to(end, axis.shape)
    along = _dot(axis, start) * _dot(axis, end)
    return np.arctan2(_dot(axis, cross(start, end)), _dot(start, end) - along)


def aim_two_axes(
    axis1: np.ndarray,
    axis2: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    near: tuple[np.ndarray | float, np.ndarray | float] = (0.0, 0.0),
) -> tuple[Pair, Pair]:
    """Angles with turn(axis1, q1) turn(axis2, q2) start = end: both pairs, the nearer first.

    Where no angles do, those that come nearest.

    Parameters
    ----------
    axis1, axis2, start : (3,) arrays
        Unit vectors; `start` is not along `axis2`.
    end : (..., 3) array
        Unit vectors.
    near : pair of (...) arrays
        The angles of the home configuration, which tell the two pairs apart [rad].

    Returns
    -------
    nearer, other : pairs (q1, q2) of (...) arrays [rad]
    """
    across = start - axis2 * (axis2 @ start)
    a, b = axis1 @ across, axis1 @ np.cross(axis2, start)
    wanted = end @ axis1 - (axis1 @ axis2) * (axis2 @ start)
    size = np.hypot(a, b)
    middle = np.arctan2(b, a)
    swing = np.arccos(np.clip(wanted / (size if size > 0 else 1.0), -1.0, 1.0))
    pairs = []
    for q2 in (middle + swing, middle - swing):
        wrapped = np.arctan2(np.sin(q2), np.cos(q2))
        turned = np.einsum("...ij,j->...i", turn_about(axis2, wrapped), start)
        pairs.append((angle_between(axis1, turned, end), wrapped))
    (p1, p2), (m1, m2) = pairs
    from_p = angle_apart(p1, near[0]) + angle_apart(p2, near[1])
    from_m = angle_apart(m1, near[0]) + angle_apart(m2, near[1])
    p_nearer = from_p <= from_m
    nearer = np.where(p_nearer, p1, m1), np.where(p_nearer, p2, m2)
    other = np.where(p_nearer, m1, p1), np.where(p_nearer, m2, p2)
    return nearer, other


def angle_apart(a: np.ndarray, b: np.ndarray | float) -> np.ndarray:
    """How far two angles are apart, whole turns left out: 1 - cos(a - b) (...), 0 to 2.

    Examples
    --------
    >>> angle_apart(np.array(np.pi), -np.pi)
    np.float64(0.0)
    """
    return 1.0 - np.cos(a - b)


def shortest_turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Rotation vector (..., 3) of the shortest turn from the unit vector `start` to `end`."""
    normal = cross(np.broadcast_to(start, end.shape), end)
    sine = np.sqrt(_dot(normal, normal))
    cosine = _dot(np.broadcast_to(start, end.shape), end)
    opposite = np.eye(3)[np.argmin(np.abs(start))]
    opposite = np.cross(start, opposite) / np.linalg.norm(np.cross(start, opposite))
    direction = np.where(
        (sine > 0)[..., None], normal / np.where(sine > 0, sine, 1.0)[..., None], opposite
    )
    return direction * np.arctan2(sine, cosine)[..., None]


def twist_angle(axis: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Angle of a rotation R about the unit vector `axis` (...) [rad]."""
    sine = (
        axis[0] * (R[..., 2, 1] - R[..., 1, 2])
        + axis[1] * (R[..., 0, 2] - R[..., 2, 0])
        + axis[2] * (R[..., 1, 0] - R[..., 0, 1])
    )
    return np.arctan2(sine, np.einsum("...ii->...", R) - 1.0)


def take_up(axes: tuple[np.ndarray, ...], R: np.ndarray) -> tuple[np.ndarray, ...]:
    """Angles of one to three axes whose turns in order make up the rotation R, or come nearest.

    Parameters
    ----------
    axes : one to three (3,) arrays
        Unit vectors.
    R : (..., 3, 3) array

    Returns
    -------
    tuple of (...) arrays [rad]
    """
    *first, last = axes
    image = np.einsum("...ij,j->...i", R, last)
    if not first:
        return (twist_angle(last, R),)
    if len(first) == 1:
        angles: tuple[np.ndarray, ...] = (angle_between(first[0], last, image),)
    else:
        angles = aim_two_axes(first[0], first[1], last, image)[0]
    left = R
    for axis, angle in zip(first, angles, strict=True):
        left = product(transposed(turn_about(axis, angle)), left)
    return (*angles, twist_angle(last, left))
