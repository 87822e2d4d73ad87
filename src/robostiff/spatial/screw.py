"""What a twist is: a translation, a rotation about a line, or a screw motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robostiff.errors import InputError
from robostiff.spatial.joint_twist import cross


@dataclass(frozen=True)
class Screw:
    """An instantaneous motion: about and along a line.

    Attributes
    ----------
    direction : (3,) array
        Unit vector along the line (or of the translation).
    point : (3,) array or None
        A point of the line [m]; None for a pure translation.
    pitch : float or None
        Advance along the line per turn angle [m/rad]: 0 for a pure rotation, None for a pure
        translation.
    """

    direction: np.ndarray
    point: np.ndarray | None
    pitch: float | None

    @property
    def is_translation(self) -> bool:
        """Whether nothing turns."""
        return self.pitch is None

    @property
    def is_rotation(self) -> bool:
        """Whether a whole line stays where it is."""
        return self.pitch == 0.0


def screw_of_twist(
    t: Float[np.ndarray, 6],
    reference_point: Float[np.ndarray, 3],
    length: float,
    tolerance: float = 1e-7,
) -> Screw:
    """Axis and pitch of a twist (dx, dy, dz, rx, ry, rz) of the reference point.

    The axis point is the one nearest to the reference point, p = E + (w x v) / w.w, and the pitch
    is v.w / w.w.

    Parameters
    ----------
    t : (6,) array
        Twist [m, rad].
    reference_point : (3,) array
        The point E whose translation `t` tells [m].
    length : float
        Characteristic length [m] that says when a turn is small beside a translation.
    tolerance : float
        Turns and pitches below this part of the whole count as none.

    Raises
    ------
    InputError
        When the twist is zero.

    Examples
    --------
    >>> turn = np.array([0, -1.0, 0, 0, 0, 1.0])
    >>> screw_of_twist(turn, np.zeros(3), length=1.0).point
    array([1., 0., 0.])
    """
    v, w = t[:3], t[3:]
    scale = np.hypot(np.linalg.norm(v), length * np.linalg.norm(w))
    if scale == 0:
        raise InputError("twist", got=t.tolist(), expected="a motion, not zero")
    if length * np.linalg.norm(w) <= tolerance * scale:
        return Screw(v / np.linalg.norm(v), None, None)
    square = w @ w
    pitch = float(v @ w / square)
    if abs(pitch) <= tolerance * scale / np.sqrt(square):
        pitch = 0.0
    return Screw(w / np.sqrt(square), reference_point + cross(w, v) / square, pitch)
