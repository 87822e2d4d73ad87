"""The pose of a formula: home, a general pose in symbols, or given coordinates."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from scipy.spatial.transform import Rotation

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.pose import held_sums
from robostiff.kinematics.turn import turn_by_cosine
from robostiff.model import Coordinate, Passive, Robot
from robostiff.record import Entry, cosine, sine, square_root
from robostiff.spatial import Space, exact_number

_A_QUARTER = 1e-9  # of a degree: rounding of a float

_POINT = {Coordinate.X: "x", Coordinate.Y: "y", Coordinate.Z: "z"}


_ABOUT = {Coordinate.RX: "x", Coordinate.RY: "y", Coordinate.RZ: "z"}


@frozen
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
                got=Words(f"a robot that turns about {' and '.join(free)} alone"),
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
            e = np.eye(3, dtype=int)["xyz".index(axis)]
            R = turn_by_cosine(e, cosine(angle), sine(angle)) @ R
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


@frozen
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

    names: ClassVar[tuple[str, ...]] = ("q_x", "q_y", "q_z")

    def names_of(self, coordinates: Sequence[Coordinate]) -> tuple[str, ...]:
        """Names of the parts where some of the rotations are free."""
        free = [_ABOUT[c] for c in coordinates if c in _ABOUT]
        if len(free) == 2:
            raise InputError(
                "unit quaternion",
                got=Words(f"a robot that turns about {' and '.join(free)} alone"),
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


@frozen
class AtHome:
    """The home configuration."""


@frozen
class AtSymbols:
    """A general pose: each free coordinate of the robot is a symbol.

    The point is (x, y, z); the rotation is Rz(gamma) Ry(beta) Rx(alpha), turns about the world's x,
    y and z one after the other. A serial arm has its joint coordinates q1, q2 and so on instead.
    A coordinate that has the name of a parameter gets a P behind it, such as alpha_P. Where the
    platform moves along the other coordinates as well, as that of a 3-RPS does, all six are
    symbols, and the formula holds where the legs close.

    Attributes
    ----------
    rotation : EulerAngles or UnitQuaternion
        Other coordinates of the rotation, such as ``EulerAngles("ZXZ")`` or ``roll_pitch_yaw()``.
    """

    rotation: PoseRotation = ABOUT_WORLD_AXES


@frozen
class AtCoordinates:
    """A pose with numbers or formulas for some coordinates; the others are those of home.

    Attributes
    ----------
    values : mapping of names to numbers or SymPy expressions
        ``x, y, z`` [m] and ``alpha, beta, gamma`` [rad] as in `AtSymbols`; ``q1, q2, ...`` for a
        serial arm.
    rotation : EulerAngles or UnitQuaternion
        Other coordinates of the rotation, by their names.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    rotation: PoseRotation = ABOUT_WORLD_AXES


@frozen
class AtJoints:
    """A general posture by the joint coordinates of all legs, each a symbol.

    `theta_1_2` is the angle of the second freedom of the first leg, `s_1_2` the coordinate of a
    slide there; what stays as the model has it, or is equal to another, has no symbol. The formula
    of a leg is in its own coordinates, and holds where the legs close. A serial arm has `q1`, `q2`,
    ... as in `AtSymbols`.
    """

    rotation: ClassVar[PoseRotation] = ABOUT_WORLD_AXES


PoseFormula = AtHome | AtSymbols | AtCoordinates | AtJoints


def coordinate_expressions(robot: Robot, pose: PoseFormula) -> dict[str, Any] | None:
    """The given coordinates of the pose, as SymPy expressions; None at home.

    Raises
    ------
    InputError
        When a name is no coordinate of the robot, or a value is no finite number or formula.
    """
    if isinstance(pose, AtHome) or (isinstance(pose, AtJoints) and not robot.is_posed_by_joints):
        return None
    names = coordinate_names(robot, pose.rotation)
    if not isinstance(pose, AtCoordinates):
        taken = {str(symbol) for symbol in robot.symbols}
        return {name: sp.Symbol(free_name(name, taken), real=True) for name in names}
    for name in pose.values:
        if name not in names:
            raise InputError(f"coordinate of {robot.name!r}", got=name, expected=", ".join(names))
    found: dict[str, Any] = {}
    for name, value in pose.values.items():
        turns = name not in ("x", "y", "z") and not isinstance(pose.rotation, UnitQuaternion)
        if robot.is_posed_by_joints:
            turns = robot.legs[0].chain.freedoms[int(name.removeprefix("q")) - 1].turns
        plain = exact_angle(value) if turns else sp.nsimplify(exact_number(value), rational=True)
        found[name] = plain
    return found


def exact_angle(angle: Any) -> Any:
    """An angle [rad] as an exact number: multiples of a quarter of a degree as parts of pi."""
    exact = sp.nsimplify(exact_number(angle), rational=True)
    if not exact.is_Rational:
        return exact
    quarters = float(exact) * 720 / math.pi
    if abs(quarters - round(quarters)) < _A_QUARTER:
        return sp.Rational(round(quarters), 720) * sp.pi
    return exact


def coordinate_names(robot: Robot, rotation: PoseRotation = ABOUT_WORLD_AXES) -> tuple[str, ...]:
    """Names of the coordinates that a pose formula of a robot may have.

    Raises
    ------
    InputError
        When the rotation has no coordinates for the free rotations of the robot.
    """
    if robot.is_posed_by_joints:
        if rotation != ABOUT_WORLD_AXES:
            raise InputError(
                f"rotation of {robot.name!r}",
                got=rotation.words,
                expected="none: the pose of a serial arm is that of its joints q1, q2, ...",
            )
        chain = robot.legs[0].chain
        places = {place for place, _ in held_sums(chain)}
        return tuple(f"q{i + 1}" for i in range(chain.size) if i not in places)
    point = tuple(_POINT[c] for c in robot.coordinates if c in _POINT)
    return (*point, *rotation.names_of(robot.coordinates))


def all_names(rotation: PoseRotation) -> tuple[str, ...]:
    """Names of all six coordinates."""
    return (*_POINT.values(), *rotation.names)


def free_name(name: str, taken: Collection[str]) -> str:
    """A coordinate with the name of a parameter gets the suffix P, for platform."""
    while name in taken:
        name = f"{name}_P"
    return name


def platform_pose(
    home: FormulaPose,
    coordinates: Mapping[str, Any] | None,
    rotation: PoseRotation = ABOUT_WORLD_AXES,
) -> FormulaPose:
    """The pose of the platform from recorded coordinates; home where none are given.

    Without an angle among the coordinates the rotation is that of home; otherwise the angles that
    are missing are zero.
    """
    if coordinates is None:
        return home
    p = [coordinates.get(name, home.p[i]) for i, name in enumerate("xyz")]
    turned = any(name in coordinates for name in rotation.names)
    R = rotation.matrix(coordinates) if turned else home.R
    return FormulaPose(R, np.array(p, dtype=object))


def is_short_in_angles(robot: Robot) -> bool:
    """Whether it is a chain in the plane whose passive joints leave it one wrench, or two.

    What these meet is short at any joint coordinates.
    """
    roles = (joint.role for leg in robot.legs for joint, _ in leg.chain.moving)
    is_passive = any(isinstance(role, Passive) for role in roles)
    return robot.is_posed_by_joints and robot.space is Space.PLANAR and is_passive
