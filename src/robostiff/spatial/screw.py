"""Unit screws of joints, eq. (17), and twists as translations, rotations or screw motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.spatial.batch import Float, Shaped, empty_batch, vector_of_entries


def cross(
    a: Shaped[np.ndarray, "*#batch 3"], b: Shaped[np.ndarray, "*#batch 3"]
) -> Shaped[np.ndarray, "*batch 3"]:
    """Vector product over leading axes (np.cross costs four to ten times as much).

    Examples
    --------
    >>> cross(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    array([0., 0., 1.])
    """
    dtype = np.result_type(a, b)
    if a.ndim == b.ndim == 1 and dtype in (float, object):  # numbers of Python are faster
        (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
        return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], dtype=dtype)
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    return vector_of_entries([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


@frozen
class Screw:
    """A unit screw: a motion about and along a line, such as the freedom of a joint.

    Its coordinate is an angle wherever it turns: of one radian it turns by one, and advances by the
    pitch. That of a translation is a length.

    Attributes
    ----------
    axis : (..., 3) array
        Unit vector along the line (or of the translation).
    point : (..., 3) array or None
        A point of the line [m]; of a translation any point, or None.
    pitch : float, formula or None
        Advance along the line per turn angle [m/rad]: 0 for a pure rotation, None for a pure
        translation.

    Examples
    --------
    >>> nut = Screw(np.array([0.0, 0.0, 1.0]), np.zeros(3), 0.002)
    >>> nut.turns, nut.slides, nut.unit
    (True, True, 'rad')
    """

    axis: np.ndarray
    point: Any
    pitch: Any

    @property
    def turns(self) -> bool:
        """Whether anything turns: its coordinate is an angle, and the place of its axis matters."""
        return self.pitch is not None

    @property
    def slides(self) -> bool:
        """Whether anything slides along the axis."""
        return self.pitch is None or self.pitch != 0

    @property
    def is_translation(self) -> bool:
        """Whether nothing turns."""
        return not self.turns

    @property
    def is_rotation(self) -> bool:
        """Whether a whole line stays where it is; after a full turn all is as before."""
        return not self.slides

    @property
    def unit(self) -> str:
        """SI unit of its coordinate."""
        return "rad" if self.turns else "m"

    @property
    def load_unit(self) -> str:
        """SI unit of the load that does work on its coordinate."""
        return "N m" if self.turns else "N"

    @property
    def pitch_per_turn(self) -> Any:
        """Advance along the line per full turn [m]; None for a pure translation."""
        return None if self.pitch is None else self.pitch * full_turn(self.pitch)

    def advance(self, coordinate: Any) -> Any:
        """How far a coordinate [rad or m] slides along the axis [m]."""
        return coordinate if self.pitch is None else self.pitch * coordinate

    def twist(self, at: Shaped[np.ndarray, "*#batch 3"]) -> Shaped[np.ndarray, "*batch 6"]:
        """Twist of the point `at` per unit of the coordinate, eq. (17), J = [e x r + h e; e].

        For a rotation that is J_rot = [e x r; e], which the paper misnames J_tran, and for a
        translation J_tran = [e; 0]; r leads from the point of the axis to `at`.

        Examples
        --------
        >>> e, o = np.array([0.0, 0.0, 1.0]), np.zeros(3)
        >>> Screw(e, o, 0.1).twist(np.array([2.0, 0.0, 0.0]))
        array([0. , 2. , 0.1, 0. , 0. , 1. ])
        >>> Screw(e, o, None).twist(np.array([2.0, 0.0, 0.0]))
        array([0., 0., 1., 0., 0., 0.])
        """
        # A slide before it moves the point of an axis that keeps its direction.
        shape = np.broadcast_shapes(self.axis.shape, at.shape, np.shape(self.point))
        e = np.broadcast_to(self.axis, shape)
        r = np.zeros_like(e) if self.pitch is None else np.broadcast_to(at - self.point, shape)
        return twists_of_screws(e[..., None], r[..., None], (self.pitch,))[..., 0]


def twists_of_screws(
    e: Shaped[np.ndarray, "*batch 3 n"], r: Shaped[np.ndarray, "*batch 3 n"], pitches: Sequence[Any]
) -> Shaped[np.ndarray, "*batch 6 n"]:
    """Columns (17) of n unit screws, [e x r + h e; e], or [e; 0] of a translation.

    Axes e and arms r from their points [m] are columns (..., 3, n); `pitches` [m/rad] are as those
    of `Screw`.
    """
    J = empty_batch(e.shape[:-2], (6, e.shape[-1]), np.result_type(e, r))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        J[..., i, :] = e[..., j, :] * r[..., k, :] - e[..., k, :] * r[..., j, :]
    J[..., 3:, :] = e
    slides = [k for k, pitch in enumerate(pitches) if pitch is None]
    if slides:
        J[..., :3, slides], J[..., 3:, slides] = e[..., slides], 0
    for k, pitch in enumerate(pitches):
        if pitch is not None and pitch != 0:
            J[..., :3, k] += pitch * e[..., k]
    return J


@frozen
class CoupledScrew(Screw):
    """The screw of a joint that others follow: no full turn brings all back."""

    @property
    def is_rotation(self) -> bool:
        """Never: what follows it has turned by another angle."""
        return False


def full_turn(value: Any) -> Any:
    """2 pi, exact beside a SymPy formula.

    Examples
    --------
    >>> import sympy as sp
    >>> sp.Symbol("p") / full_turn(sp.Symbol("p"))
    p/(2*pi)
    """
    if not hasattr(value, "xreplace"):
        return 2.0 * math.pi
    import sympy as sp

    return 2 * sp.pi


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
        The point E whose translation is that of `t` [m].
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
