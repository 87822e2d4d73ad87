"""Angles of a few axes through one point that point a line, or take up a rotation."""

from __future__ import annotations

import numpy as np

from robostiff.kinematics.turn import turn_about
from robostiff.spatial import cross
from robostiff.spatial.batch import product, transposed

Pair = tuple[np.ndarray, np.ndarray]
Sign = int | np.ndarray


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
    axis1: np.ndarray, axis2: np.ndarray, start: np.ndarray, end: np.ndarray, sign: Sign = 1
) -> Pair:
    """Angles with turn(axis1, q1) turn(axis2, q2) start = end, of two such pairs.

    The pairs differ in the sign of the triple product ``b.(axis1 x end)``, with b the second axis
    as the first has turned it. Where no angles do, those that come nearest.

    Parameters
    ----------
    axis1, axis2, start : (3,) arrays
        Unit vectors; `start` is not along `axis2`.
    end : (..., 3) array
        Unit vectors.
    sign : int or (...) array of int
        1 or -1: which pair.

    Returns
    -------
    q1, q2 : (...) arrays [rad]
    """
    across = start - axis2 * (axis2 @ start)
    a, b = axis1 @ across, axis1 @ np.cross(axis2, start)
    wanted = end @ axis1 - (axis1 @ axis2) * (axis2 @ start)
    size = np.hypot(a, b)
    swing = np.arccos(np.clip(wanted / (size if size > 0 else 1.0), -1.0, 1.0))
    q2 = np.arctan2(b, a) + sign * swing
    q2 = np.arctan2(np.sin(q2), np.cos(q2))
    turned = np.einsum("...ij,j->...i", turn_about(axis2, q2), start)
    return angle_between(axis1, turned, end), q2


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


def take_up(axes: tuple[np.ndarray, ...], R: np.ndarray, sign: Sign = 1) -> tuple[np.ndarray, ...]:
    """Angles of one to three axes whose turns in order make up the rotation R, or come nearest.

    Parameters
    ----------
    axes : one to three (3,) arrays
        Unit vectors.
    R : (..., 3, 3) array
    sign : int or (...) array of int
        Of three axes, which of the two ways, as in `aim_two_axes`.

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
        angles = aim_two_axes(first[0], first[1], last, image, sign)
    left = R
    for axis, angle in zip(first, angles, strict=True):
        left = product(transposed(turn_about(axis, angle)), left)
    return (*angles, twist_angle(last, left))
