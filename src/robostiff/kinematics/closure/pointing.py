"""Two joints at the ends of a rod, and the angles of a few axes that point a line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.closure.assembly import Mode
from robostiff.kinematics.closure.skeleton import Cluster
from robostiff.kinematics.turn import turn_about, turn_by_vector, vector_of_turn
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


def fits(first: Cluster, second: Cluster, along: np.ndarray) -> bool:
    """Whether the two joints can be solved one after the other for a rod `along` a direction."""
    if first.is_ball:
        return True
    pointing = first.axes[-1]
    return float(np.linalg.norm(np.cross(pointing, along))) > 1e-6 and (
        second.is_ball or len(second.axes) <= 2
    )


def has_two_ways(first: Cluster, second: Cluster, spin: int | None) -> tuple[bool, bool]:
    """Whether each joint can do its part in two ways, by the other sign of a triple product."""
    turned_by_second = not second.is_ball and (spin is not None or first.is_ball)
    return (
        not first.is_ball and len(first.axes) == 2,
        turned_by_second and len(second.axes) == 2,
    )


def point_and_take_up(
    q: np.ndarray,
    first: Cluster,
    second: Cluster,
    along: np.ndarray,
    direction: np.ndarray,
    R_wanted: np.ndarray,
    spin: int | None,
    mode: Mode,
) -> None:
    """Write the angles of both joints into q, so that the rod points in `direction`.

    A turn of the rod about itself that nothing determines stays as it is at home.

    Parameters
    ----------
    q : (..., size) array
        Coordinates, filled in place; those of the home configuration to begin with.
    first, second : Cluster
        Joints at the near and the far end of the rod.
    along : (3,) array
        Direction of the rod at zero coordinates.
    direction : (..., 3) array
        Wanted direction, seen from what carries the first joint.
    R_wanted : (..., 3, 3) array
        Wanted product of both joints' rotations.
    spin : int or None
        Place of a turn about the rod itself (the turn of a cylindrical joint), if there is one.
    mode : Mode
    """
    if first.is_ball:
        R_home = _home_of_ball(q, first)
        turn = turn_by_vector(shortest_turn(R_home @ along, direction))
        R_first = product(turn, R_home)
    else:
        angles = _pointing_angles(first, along, direction, mode)
        R_first = turns_about(first.axes, angles)
        _write(q, first, angles)
    spun = None if spin is None else turn_about(along, q[..., spin])
    if second.is_ball:
        if first.is_ball:
            _write_ball(q, first, R_first)
        R_near = R_first if spun is None else product(R_first, spun)
        _write_ball(q, second, product(transposed(R_near), R_wanted))
        return
    left = product(transposed(R_first), R_wanted)
    if not first.is_ball and spin is None:
        _write(q, second, take_up(second.axes, left))
        return
    psi, *angles = take_up((along, *second.axes), left, mode.second)
    _write(q, second, angles)
    if first.is_ball:
        R_first = product(R_first, turn_about(along, psi))
        R_first = R_first if spun is None else product(R_first, transposed(spun))
        _write_ball(q, first, R_first)
    else:
        q[..., spin] = psi


def _pointing_angles(
    cluster: Cluster, along: np.ndarray, direction: np.ndarray, mode: Mode
) -> tuple[np.ndarray, ...]:
    """Angles of one or two axes that point the rod."""
    if len(cluster.axes) == 1:
        return (angle_between(cluster.axes[0], along, direction),)
    first, second = cluster.axes
    return aim_two_axes(first, second, along, direction, mode.first)


def turns_about(axes: Sequence[np.ndarray], angles: Sequence[np.ndarray]) -> np.ndarray:
    """Rotations about several axes, one after the other in the frame that the last one made."""
    R = turn_about(axes[0], angles[0])
    for axis, angle in zip(axes[1:], angles[1:], strict=True):
        R = product(R, turn_about(axis, angle))
    return R


def _write(q: np.ndarray, cluster: Cluster, angles: tuple[np.ndarray, ...] | list) -> None:
    for place, angle in zip(cluster.places, angles, strict=True):
        q[..., place] = angle


def _write_ball(q: np.ndarray, cluster: Cluster, R: np.ndarray) -> None:
    own = np.stack(cluster.axes, axis=-1)  # the joint's own frame, all coordinates zero
    R_own = np.einsum("ji,...jk,kl->...il", own, R, own)
    q[..., list(cluster.places)] = vector_of_turn(R_own)


def _home_of_ball(q: np.ndarray, cluster: Cluster) -> np.ndarray:
    """Rotation of a spherical joint at home, (3, 3)."""
    own = np.stack(cluster.axes, axis=-1)
    home = q[..., list(cluster.places)].reshape(-1, 3)[:1]
    return own @ turn_by_vector(home)[0] @ own.T if len(home) else np.eye(3)
