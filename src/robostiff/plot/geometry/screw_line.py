"""A screw as lines: its axis, and the path of a point around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.spatial import Screw

_TURN = 1.75 * np.pi
_TURNS_OF_A_SCREW = 2.0
_RADIUS = 0.3  # of half the axis
_STEPS = 96


@dataclass(frozen=True)
class ScrewLine:
    """Lines that show a motion.

    Attributes
    ----------
    axis : (2, 3) array
        Ends of the axis, or of the way of a translation.
    way : (n, 3) array
        Of a point that turns (an arc) or turns and advances (a helix with the pitch of the screw);
        no points for a translation.
    """

    axis: np.ndarray
    way: np.ndarray


def screw_line(screw: Screw, near: np.ndarray, half_length: float) -> ScrewLine:
    """Lines that show a screw near a point.

    Parameters
    ----------
    screw : Screw
    near : (3,) array
        A translation is drawn here, an axis where it passes nearest [m].
    half_length : float
        Of the axis [m]. A helix turns no further than its axis is long.

    Examples
    --------
    >>> turn = Screw(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 0.0)
    >>> screw_line(turn, np.zeros(3), 0.5).axis.tolist()
    [[1.0, 0.0, -0.5], [1.0, 0.0, 0.5]]
    """
    e = screw.axis
    if screw.point is None:
        axis = near + half_length * np.array([-e, e])
        return ScrewLine(axis, np.zeros((0, 3)))
    centre = screw.point + e * (e @ (near - screw.point))
    pitch = screw.pitch or 0.0
    turned = _TURN if pitch == 0 else 2 * np.pi * _TURNS_OF_A_SCREW
    if abs(pitch) * turned > 2 * half_length:
        turned = 2 * half_length / abs(pitch)
    angle = np.linspace(-turned / 2, turned / 2, _STEPS)[:, None]
    across = np.eye(3)[np.argmin(np.abs(e))]
    first = across - e * (e @ across)
    first = first / np.linalg.norm(first)
    radius = _RADIUS * half_length
    around = radius * (np.cos(angle) * first + np.sin(angle) * np.cross(e, first))
    way = centre + around + pitch * angle * e
    return ScrewLine(centre + half_length * np.array([-e, e]), way)
