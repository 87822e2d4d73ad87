"""Unit screws of joints, eq. (17), and twists as translations, rotations or screw motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Shaped

from robostiff.errors import InputError
from robostiff.spatial.batch import empty_batch, vector_of_entries


def translation_twist(e: Shaped[np.ndarray, "*batch 3"]) -> Shaped[np.ndarray, "*batch 6"]:
    """Column of a prismatic joint, J_tran = [e; 0], eq. (17).

    Parameters
    ----------
    e : (..., 3) array
        Unit vector along the joint axis.

    Returns
    -------
    (..., 6) array

    Examples
    --------
    >>> translation_twist(np.array([0.0, 0.0, 1.0]))
    array([0., 0., 1., 0., 0., 0.])
    """
    twist = empty_batch(e.shape[:-1], (6,), e.dtype)
    twist[..., :3], twist[..., 3:] = e, 0
    return twist


def rotation_twist(
    e: Shaped[np.ndarray, "*#batch 3"], r: Shaped[np.ndarray, "*#batch 3"]
) -> Shaped[np.ndarray, "*batch 6"]:
    """Column of a revolute joint, J_rot = [e x r; e], eq. (17), where it is misnamed J_tran.

    Parameters
    ----------
    e : (..., 3) array
        Unit vector along the joint axis.
    r : (..., 3) array
        Vector from a point of the axis to the reference point [m].

    Returns
    -------
    (..., 6) array

    Examples
    --------
    >>> rotation_twist(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))
    array([0., 2., 0., 0., 0., 1.])
    """
    batch = np.broadcast_shapes(e.shape, r.shape)[:-1]
    twist = empty_batch(batch, (6,), np.result_type(e, r))
    twist[..., :3], twist[..., 3:] = cross(e, r), e
    return twist


def cross(
    a: Shaped[np.ndarray, "*#batch 3"], b: Shaped[np.ndarray, "*#batch 3"]
) -> Shaped[np.ndarray, "*batch 3"]:
    """Vector product over leading axes (np.cross costs four times as much on batches).

    Examples
    --------
    >>> cross(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    array([0., 0., 1.])
    """
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    return vector_of_entries([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


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
