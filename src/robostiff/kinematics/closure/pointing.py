"""The two joints at the ends of a rod: one points it, the other takes up what turn remains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.closure.aim import aim_two_axes, angle_between, shortest_turn, take_up
from robostiff.kinematics.closure.skeleton import Cluster
from robostiff.kinematics.turn import turn_about, turn_by_vector, vector_of_turn
from robostiff.spatial.batch import product, transposed

_SAME = 1e-12  # of the square of a chord: rounding


def fits(first: Cluster, second: Cluster, along: np.ndarray) -> bool:
    """Whether the two joints can be solved one after the other for a rod `along` a direction."""
    if first.is_ball:
        return True
    pointing = first.axes[-1]
    return float(np.linalg.norm(np.cross(pointing, along))) > 1e-6 and (
        second.is_ball or len(second.axes) <= 2
    )


def point_and_take_up(
    q: np.ndarray,
    first: Cluster,
    second: Cluster,
    along: np.ndarray,
    direction: np.ndarray,
    R_wanted: np.ndarray,
    spin: int | None,
) -> None:
    """Write the angles of both joints into q, so that the rod points in `direction`.

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
    """
    if spin is not None:
        q[..., spin] = 0.0
    if first.is_ball:
        R_first = turn_by_vector(shortest_turn(along, direction))
        _write_ball(q, first, R_first)
        others = []
    else:
        nearer, *others = _pointing_angles(q, first, along, direction)
        R_first = turns_about(first.axes, nearer)
        _write(q, first, nearer)
    left = product(transposed(R_first), R_wanted)
    if second.is_ball:
        _write_ball(q, second, left)
    elif spin is not None:
        psi, *angles = take_up((along, *second.axes), left)
        q[..., spin] = psi
        _write(q, second, angles)
    elif first.is_ball:
        psi, *angles = take_up((along, *second.axes), left)
        _write_ball(q, first, product(R_first, turn_about(along, psi)))
        _write(q, second, angles)
    else:
        _write(q, second, take_up(second.axes, left))
        for angles in others:
            _take_where_better(q, first, second, angles, R_wanted)


def _take_where_better(
    q: np.ndarray,
    first: Cluster,
    second: Cluster,
    angles: tuple[np.ndarray, ...],
    R_wanted: np.ndarray,
) -> None:
    """Point the other way where that alone reaches the orientation, as with five joints."""
    R_other = turns_about(first.axes, angles)
    turned = turns_about(first.axes, [q[..., place] for place in first.places])
    turned = product(turned, turns_about(second.axes, [q[..., p] for p in second.places]))
    left = product(transposed(R_other), R_wanted)
    taken = take_up(second.axes, left)
    other = product(R_other, turns_about(second.axes, taken))
    better = _missed(other, R_wanted) < _missed(turned, R_wanted) - _SAME
    for cluster, values in ((first, angles), (second, taken)):
        for place, value in zip(cluster.places, values, strict=True):
            q[..., place] = np.where(better, value, q[..., place])


def _missed(R: np.ndarray, R_wanted: np.ndarray) -> np.ndarray:
    """Square of the chord between two rotations (...)."""
    chord = R - R_wanted
    return np.einsum("...ij,...ij->...", chord, chord)


def _pointing_angles(
    q: np.ndarray, cluster: Cluster, along: np.ndarray, direction: np.ndarray
) -> tuple[tuple[np.ndarray, ...], ...]:
    """Angles of one or two axes that point the rod: one way, or two, the nearer to home first."""
    if len(cluster.axes) == 1:
        return ((angle_between(cluster.axes[0], along, direction),),)
    first, second = cluster.axes
    home = q[..., cluster.places[0]], q[..., cluster.places[1]]
    return aim_two_axes(first, second, along, direction, home)


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
