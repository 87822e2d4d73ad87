"""The pose of a formula: home, a general pose in symbols, or given coordinates."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import sympy as sp

from robostiff.analytic.placement.pose_rotation import (
    ABOUT_WORLD_AXES,
    PoseRotation,
    UnitQuaternion,
)
from robostiff.errors import InputError
from robostiff.kinematics.formula import FormulaPose
from robostiff.kinematics.pose import held_sums
from robostiff.model import Coordinate, Passive, Robot
from robostiff.spatial import Space, exact_number

_A_QUARTER = 1e-9  # of a degree: rounding of a float

_POINT = {Coordinate.X: "x", Coordinate.Y: "y", Coordinate.Z: "z"}


@dataclass(frozen=True)
class AtHome:
    """The home configuration."""


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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
    quaternion = isinstance(pose.rotation, UnitQuaternion)
    return {n: _exact(robot, n, x, quaternion=quaternion) for n, x in pose.values.items()}


def exact_angle(angle: Any) -> Any:
    """An angle [rad] as an exact number: multiples of a quarter of a degree as parts of pi.

    Examples
    --------
    >>> exact_angle(math.radians(20)), exact_angle(0.4)
    (pi/9, 2/5)
    """
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
        held = {place for place, _ in held_sums(chain)}
        return tuple(f"q{i + 1}" for i in range(chain.size) if i not in held)
    point = tuple(_POINT[c] for c in robot.coordinates if c in _POINT)
    return (*point, *rotation.names_of(robot.coordinates))


def all_names(rotation: PoseRotation) -> tuple[str, ...]:
    """Names of all six coordinates."""
    return (*_POINT.values(), *rotation.names)


def _exact(robot: Robot, name: str, value: Any, *, quaternion: bool) -> Any:
    turns = name not in ("x", "y", "z") and not quaternion
    if robot.is_posed_by_joints:
        turns = robot.legs[0].chain.freedoms[int(name.removeprefix("q")) - 1].turns
    return exact_angle(value) if turns else sp.nsimplify(exact_number(value), rational=True)


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


def home_coordinates(point: np.ndarray, rotation: PoseRotation) -> dict[str, float]:
    """Coordinates of a pose formula near which those of a general pose are chosen."""
    return dict(zip("xyz", map(float, point), strict=True)) | dict.fromkeys(rotation.names, 0.0)


def is_short_in_angles(robot: Robot) -> bool:
    """Whether it is a chain in the plane whose passive joints leave it one wrench, or two.

    What these meet is short at any joint coordinates.
    """
    roles = (joint.role for leg in robot.legs for joint, _ in leg.chain.moving)
    is_passive = any(isinstance(role, Passive) for role in roles)
    return robot.is_posed_by_joints and robot.space is Space.PLANAR and is_passive
