"""Coordinates of a rotation in a formula: turns about axes one after the other, or a quaternion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import InputError
from robostiff.model import Coordinate
from robostiff.record import Entry, cosine, sine, square_root

_ABOUT = {Coordinate.RX: "x", Coordinate.RY: "y", Coordinate.RZ: "z"}


@dataclass(frozen=True)
class EulerAngles:
    """A rotation by three angles [rad], turns one after the other.

    Attributes
    ----------
    sequence : str
        Their axes, as SciPy has them: capital letters for axes that move along, such as "ZXZ" for
        Rz(phi) Rx(theta) Rz(psi), small letters for axes that stay, such as "xyz" for
        Rz(psi) Ry(theta) Rx(phi).
    names : tuple of str
        Of the angles, in the order of the sequence.

    Examples
    --------
    >>> EulerAngles("ZXZ").words
    'R = Rz(phi) Rx(theta) Rz(psi)'
    >>> EulerAngles("xyz").words
    'R = Rz(psi) Ry(theta) Rx(phi)'
    """

    sequence: str = "ZXZ"
    names: tuple[str, ...] = ("phi", "theta", "psi")

    def __post_init__(self) -> None:
        sequence = self.sequence
        axes = sequence.lower() if isinstance(sequence, str) else ""
        same_case = axes and sequence in (axes, axes.upper())
        if (
            not same_case
            or len(axes) != 3
            or set(axes) - set("xyz")
            or axes[1] in (axes[0], axes[2])
        ):
            raise InputError(
                "sequence of Euler angles",
                got=sequence,
                expected="three of X, Y, Z (axes that move along) or of x, y, z (axes that stay), "
                "neighbours different",
                hint='write "ZXZ", "ZYX" or "xyz"',
            )
        if len(self.names) != 3 or len(set(self.names)) != 3:
            raise InputError(
                "names of Euler angles", got=", ".join(self.names), expected="three names"
            )

    def names_of(self, coordinates: Sequence[Coordinate]) -> tuple[str, ...]:
        """Names of the angles where some of the rotations are free.

        Raises
        ------
        InputError
            When the free rotations are not some of the angles.
        """
        free = [_ABOUT[c] for c in coordinates if c in _ABOUT]
        axes = self.sequence.lower()
        if len(free) in (0, 3):
            return self.names if free else ()
        if any(axes.count(axis) != 1 for axis in free):
            raise InputError(
                f"Euler angles {self.sequence}",
                got=f"a robot that turns about {' and '.join(free)} alone",
                expected="a robot with three rotations, or an angle about each of its axes",
                hint="leave out the angles: alpha, beta and gamma are about x, y and z",
            )
        return tuple(self.names[axes.index(axis)] for axis in free)

    def factors(self, values: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
        """Axes and angles of the product of turns, from left to right; missing angles are zero."""
        turns = [
            (a, values[n])
            for a, n in zip(self.sequence.lower(), self.names, strict=True)
            if n in values
        ]
        return tuple(turns if self.sequence.isupper() else reversed(turns))

    def matrix(self, values: Mapping[str, Any]) -> np.ndarray:
        """The rotation (3, 3), of numbers or entries."""
        R = np.eye(3, dtype=int).astype(object)
        for axis, angle in reversed(self.factors(values)):
            R = _turn("xyz".index(axis), angle) @ R
        return R

    def of_rotation(self, R: np.ndarray) -> dict[str, float]:
        """The angles of a rotation in numbers."""
        angles = Rotation.from_matrix(R).as_euler(self.sequence)
        return dict(zip(self.names, map(float, angles), strict=True))

    @property
    def words(self) -> str:
        """The rotation as a product."""
        return f"R = {self.in_words({name: name for name in self.names})}"

    def in_words(self, values: Mapping[str, Any]) -> str:
        """The product of the turns whose angles are given."""
        return " ".join(f"R{axis}({angle})" for axis, angle in self.factors(values))


@dataclass(frozen=True)
class UnitQuaternion:
    """A rotation by the vector (q_x, q_y, q_z) of a unit quaternion.

    Its scalar part is q_w = sqrt(1 - q_x**2 - q_y**2 - q_z**2), so that ``|q| = 1`` everywhere: q
    and -q are the same rotation, and the one with q_w >= 0 is meant.

    Examples
    --------
    >>> R = UnitQuaternion().matrix({"q_z": 0.6})
    >>> round(float(R[0, 0]), 12), round(float(R[1, 0]), 12)
    (0.28, 0.96)
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Of the vector part."""
        return ("q_x", "q_y", "q_z")

    def names_of(self, coordinates: Sequence[Coordinate]) -> tuple[str, ...]:
        """Names of the parts where some of the rotations are free."""
        free = [_ABOUT[c] for c in coordinates if c in _ABOUT]
        if len(free) == 2:
            raise InputError(
                "unit quaternion",
                got=f"a robot that turns about {' and '.join(free)} alone",
                expected="a robot with one rotation, or with three",
                hint="leave out the angles: alpha, beta and gamma are about x, y and z",
            )
        return tuple(f"q_{axis}" for axis in free)

    def factors(self, values: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
        """None: it is no product of turns."""
        return ()

    def matrix(self, values: Mapping[str, Any]) -> np.ndarray:
        """The rotation (3, 3), of numbers or entries."""
        v = [values.get(name, 0) for name in self.names]
        rest = 1 - (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        w = square_root(rest)
        if isinstance(w, Entry):
            w = w.named("q_w")
        R = np.empty((3, 3), dtype=object)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            R[i, i] = 1 - 2 * (v[j] * v[j] + v[k] * v[k])
            R[j, i] = 2 * (v[i] * v[j] + w * v[k])
            R[i, j] = 2 * (v[i] * v[j] - w * v[k])
        return R

    def of_rotation(self, R: np.ndarray) -> dict[str, float]:
        """The vector part of a rotation in numbers."""
        x, y, z, w = Rotation.from_matrix(R).as_quat()
        sign = -1.0 if w < 0 else 1.0
        return {"q_x": sign * x, "q_y": sign * y, "q_z": sign * z}

    @property
    def words(self) -> str:
        """The rotation in words."""
        return f"R of {self.in_words({})}"

    def in_words(self, values: Mapping[str, Any]) -> str:
        """The quaternion with its scalar part."""
        return "the unit quaternion (q_w, q_x, q_y, q_z), q_w >= 0"


PoseRotation = EulerAngles | UnitQuaternion

#: Turns about the world's x, then y, then z.
ABOUT_WORLD_AXES = EulerAngles("xyz", ("alpha", "beta", "gamma"))


def roll_pitch_yaw() -> EulerAngles:
    """Roll about x, then pitch about y, then yaw about z of the world.

    Examples
    --------
    >>> roll_pitch_yaw().words
    'R = Rz(yaw) Ry(pitch) Rx(roll)'
    """
    return EulerAngles("xyz", ("roll", "pitch", "yaw"))


def rotation_by_name(name: str) -> PoseRotation:
    """``rpy``, ``quaternion``, or a sequence of Euler angles such as ``ZXZ``.

    Raises
    ------
    InputError
        When it is none of them.
    """
    if name == "rpy":
        return roll_pitch_yaw()
    return UnitQuaternion() if name == "quaternion" else EulerAngles(name)


def _turn(axis: int, angle: Any) -> np.ndarray:
    c, s = cosine(angle), sine(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3, dtype=int).astype(object)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R
