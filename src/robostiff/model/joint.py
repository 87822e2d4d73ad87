"""Joints: their freedoms, and whether they are passive, actuated or locked."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np

from robostiff.elasticity.checks import positive_number
from robostiff.errors import InputError
from robostiff.frozen import field, frozen
from robostiff.model.checks import (
    are_parallel,
    axis_across,
    checked_stiffness,
    finite_coordinates,
    unit_vector,
)
from robostiff.model.stiffness_law import StiffnessLaw
from robostiff.spatial import Screw, full_turn, refuse_quantities
from robostiff.spatial.formula import Entries, Scalar, is_formula, is_possible


class JointKind(Enum):
    """Kinds of joint; a joint's freedoms follow one another from base to platform."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    HELICAL = "helical"
    UNIVERSAL = "universal"
    SPHERICAL = "spherical"
    CYLINDRICAL = "cylindrical"
    PLANAR = "planar"


@frozen
class Passive:
    """A joint that turns or slides without resistance."""


@frozen
class Actuated:
    """A joint held by its drive.

    Attributes
    ----------
    stiffness : float, SymPy expression, StiffnessLaw or None
        Of the drive [N/m or N m/rad]; None for a rigid one.
    limits : (float, float) or None
        Lowest and highest coordinate [m or rad].
    inertia : float, SymPy expression or None
        Of the rotor at the joint: its own times the square of the gear ratio [kg m^2, or kg of a
        slide]. It matters for `modes` alone.
    """

    stiffness: Any = None
    limits: tuple[float, float] | None = None
    inertia: Any = None

    def __post_init__(self) -> None:
        checked_stiffness("stiffness of the drive", self.stiffness)
        if self.inertia is not None:
            hint = "leave it out for a drive without"
            positive_number("inertia of the drive", self.inertia, "kg m^2 or kg", hint)
        if self.limits is not None:
            refuse_quantities("limits of the drive", self.limits, "lowest < highest [m or rad]")
            low, high = self.limits
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                subject = "limits of the drive"
                raise InputError(subject, got=self.limits, expected="lowest < highest")
            if isinstance(self.stiffness, StiffnessLaw):
                self.stiffness.check(self.limits)


@frozen
class Locked:
    """A joint that keeps its home coordinate.

    Attributes
    ----------
    stiffness : float, SymPy expression or None
        Of the lock or flexure [N/m or N m/rad]; None for a rigid one.
    """

    stiffness: Any = None

    def __post_init__(self) -> None:
        checked_stiffness("stiffness of the lock", self.stiffness)


Role = Passive | Actuated | Locked


@frozen
class Joint:
    """A joint of a chain; build it with `revolute`, `prismatic`, `helical` and their like.

    Attributes
    ----------
    kind : JointKind
    freedoms : tuple of Screw
        In order from base to platform, each through the origin of the frame made by those before
        it. The three of a spherical joint are the frame axes, and its coordinates are a rotation
        vector.
    role : Passive, Actuated or Locked
    home : tuple of float or formula
        Coordinates in the home configuration [m, rad]; zeros when left out.
    name : str
    home_given : bool
        Whether the home coordinates were chosen, and not left out.
    """

    kind: JointKind
    freedoms: tuple[Screw, ...]
    role: Role
    home: tuple[Any, ...] = ()
    name: str = ""
    home_given: bool | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.role, Role):
            raise InputError(
                f"role of the {self.kind.value} joint",
                got=self.role,
                expected="Passive(), Actuated(stiffness) or Locked(stiffness)",
            )
        subject = f"home coordinates of the {self.kind.value} joint"
        if self.home_given is None:
            object.__setattr__(self, "home_given", bool(self.home))
        home = self.home or (0.0,) * len(self.freedoms)
        home = finite_coordinates(subject, home, len(self.freedoms))
        object.__setattr__(self, "home", home)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.freedoms)


def revolute(
    axis: Entries, role: Role, *, home: Sequence[Scalar] = (), name: str = "revolute"
) -> Joint:
    """Joint that turns about `axis`.

    Examples
    --------
    >>> revolute([0, 0, 2], Passive()).freedoms[0].axis
    array([0., 0., 1.])
    """
    freedoms = (_turn(unit_vector("axis of the revolute joint", axis)),)
    return Joint(JointKind.REVOLUTE, freedoms, role, tuple(home), name)


def prismatic(
    axis: Entries, role: Role, *, home: Sequence[Scalar] = (), name: str = "prismatic"
) -> Joint:
    """Joint that slides along `axis`."""
    freedoms = (_slide(unit_vector("axis of the prismatic joint", axis)),)
    return Joint(JointKind.PRISMATIC, freedoms, role, tuple(home), name)


def helical(
    axis: Entries, pitch: Scalar, role: Role, *, home: Sequence[Scalar] = (), name: str = "helical"
) -> Joint:
    """Joint that turns about `axis` and advances along it, as a nut does on a screw.

    Its coordinate is the angle [rad], of any number of turns. A drive or lock has a stiffness
    against this angle [N m/rad].

    Parameters
    ----------
    axis : (3,) array-like
    pitch : float or formula
        Advance along the axis of one full turn [m]: positive for a right-handed screw, negative
        for a left-handed one. (That of its `Screw` is for one radian.)

    Examples
    --------
    >>> (nut,) = helical([0, 0, 1], 0.005, Passive()).freedoms
    >>> nut.pitch_per_turn
    0.005
    """
    direction = unit_vector("axis of the helical joint", axis)
    subject, expected = "pitch of the helical joint", "a finite length per turn, not zero [m]"
    refuse_quantities(subject, pitch, expected)
    if is_formula(pitch):
        fits = is_possible(pitch) and getattr(pitch, "is_zero", None) is not True
    else:
        fits = np.isfinite(pitch) and pitch != 0
    if not fits:
        hint = "a joint of no pitch is a revolute joint"
        raise InputError(subject, got=pitch, expected=expected, hint=hint)
    advance = pitch if is_formula(pitch) else float(pitch)
    freedoms = (Screw(direction, np.zeros(3), advance / full_turn(advance)),)
    return Joint(JointKind.HELICAL, freedoms, role, tuple(home), name)


def joint_of(freedom: Screw, role: Role) -> Joint:
    """Joint of a single freedom, of the kind that it is."""
    if not freedom.turns:
        kind = JointKind.PRISMATIC
    else:
        kind = JointKind.HELICAL if freedom.slides else JointKind.REVOLUTE
    return Joint(kind, (freedom,), role)


def universal(
    axis1: Entries,
    axis2: Entries,
    role: Role,
    *,
    home: Sequence[Scalar] = (),
    name: str = "universal",
) -> Joint:
    """Joint that turns about `axis1`, then about `axis2`, which turns along with the first."""
    first = unit_vector("first axis of the universal joint", axis1)
    second = unit_vector("second axis of the universal joint", axis2)
    if are_parallel(first, second):
        raise InputError(
            "axes of the universal joint",
            got=[np.asarray(axis1).tolist(), np.asarray(axis2).tolist()],
            expected="two directions that are not parallel",
        )
    freedoms = (_turn(first), _turn(second))
    return Joint(JointKind.UNIVERSAL, freedoms, role, tuple(home), name)


def spherical(role: Role, *, home: Sequence[Scalar] = (), name: str = "spherical") -> Joint:
    """Joint that turns freely about a point; its coordinates are a rotation vector [rad]."""
    freedoms = tuple(map(_turn, np.eye(3)))
    return Joint(JointKind.SPHERICAL, freedoms, role, tuple(home), name)


def cylindrical(
    axis: Entries, role: Role, *, home: Sequence[Scalar] = (), name: str = "cylindrical"
) -> Joint:
    """Joint that slides along `axis` and turns about it; coordinates (slide, turn)."""
    direction = unit_vector("axis of the cylindrical joint", axis)
    freedoms = (_slide(direction), _turn(direction))
    return Joint(JointKind.CYLINDRICAL, freedoms, role, tuple(home), name)


def planar(
    normal: Entries, role: Role, *, home: Sequence[Scalar] = (), name: str = "planar"
) -> Joint:
    """Joint that slides in the plane across `normal` and turns about it.

    Its coordinates are two slides and a turn. The first slide runs along the frame axis that is
    most nearly in the plane, projected into it; the second along normal x first.
    """
    n = unit_vector("normal of the planar joint", normal)
    start = axis_across(n)
    first = unit_vector("slide", start - n * (n @ start))
    freedoms = (_slide(first), _slide(np.cross(n, first)), _turn(n))
    return Joint(JointKind.PLANAR, freedoms, role, tuple(home), name)


def _turn(axis: np.ndarray) -> Screw:
    return Screw(axis, np.zeros(3), 0.0)


def _slide(axis: np.ndarray) -> Screw:
    return Screw(axis, np.zeros(3), None)
