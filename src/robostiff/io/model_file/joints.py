"""Joints in a model file: the keys of each kind, its freedoms, its role, and laws of force."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Tag

from robostiff.io.expression import exact_mathematics, parse
from robostiff.io.model_file.place import Place, direction, vector
from robostiff.io.model_file.written_parts import (
    Direction,
    Name,
    Pair,
    Value,
    Vector,
    WrittenMapping,
    either,
)
from robostiff.io.units import Dimension, make_quantity, make_unit, to_si
from robostiff.kinematics import find_posture
from robostiff.model import (
    Actuated,
    ForceLaw,
    Joint,
    Locked,
    Passive,
    PlacedFreedom,
    Robot,
    Role,
    StiffnessLaw,
    cylindrical,
    helical,
    planar,
    prismatic,
    revolute,
    spherical,
    universal,
)
from robostiff.spatial import Screw


class WrittenDrive(WrittenMapping):
    """Common keys of joints and telescopes: role, stiffness, limits and home."""

    name: Name | None = None
    role: Literal["passive", "actuated", "locked"] = Field(
        description="passive, actuated or locked"
    )
    stiffness: Value | None = None
    limits: Pair | None = None
    inertia: Value | None = Field(
        default=None,
        description="of the rotor at the joint, times gear^2: kg m^2, or kg of a slide",
    )


_Axis = Annotated[Direction, Field(description="the axis, such as z or [0, 0, 1]")]
_Make = Callable[..., Joint]


class WrittenOneAxisJoint(WrittenDrive):
    """Revolute or prismatic joint."""

    type: Literal["revolute", "prismatic"]
    axis: _Axis
    home: Value | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        make = revolute if self.type == "revolute" else prismatic
        return partial(make, direction(place / "axis", self.axis))


class WrittenHelical(WrittenDrive):
    """Helical joint."""

    type: Literal["helical"]
    axis: _Axis
    pitch: Value = Field(
        description="the advance along the axis in one full turn, such as 5 mm; negative for a "
        "left-handed screw"
    )
    home: Value | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        pitch = (place / "pitch").number(self.pitch, Dimension.ADVANCE_PER_TURN)
        return partial(helical, direction(place / "axis", self.axis), pitch)


class WrittenUniversal(WrittenDrive):
    """Universal joint."""

    type: Literal["universal"]
    axes: Annotated[list[Direction], Field(min_length=2, max_length=2)] = Field(
        description="the two axes, such as [x, y], the one at the base side first"
    )
    home: Pair | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        axes = [direction(place / "axes" / i, axis) for i, axis in enumerate(self.axes)]
        return partial(universal, *(axis.tolist() for axis in axes))


class WrittenSpherical(WrittenDrive):
    """Spherical joint."""

    type: Literal["spherical"]
    home: Vector | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        del place
        return spherical


class WrittenCylindrical(WrittenDrive):
    """Cylindrical joint."""

    type: Literal["cylindrical"]
    axis: _Axis
    home: Pair | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        return partial(cylindrical, direction(place / "axis", self.axis))


class WrittenPlanar(WrittenDrive):
    """Planar joint."""

    type: Literal["planar"]
    normal: Direction = Field(description="the direction across the plane, such as z")
    home: Vector | None = None

    def made(self, place: Place) -> _Make:
        """What makes it of a role."""
        return partial(planar, direction(place / "normal", self.normal))


WrittenJoint = (
    WrittenOneAxisJoint
    | WrittenHelical
    | WrittenUniversal
    | WrittenSpherical
    | WrittenCylindrical
    | WrittenPlanar
)


def build_joint(place: Place, written: WrittenJoint, name: str) -> Joint:
    """The joint that is written at a place."""
    make = written.made(place)
    with place.complaints():
        joint = make(Passive(), name=name)
    dimensions = tuple(map(coordinate_dimension, joint.freedoms))
    role = build_role(place, written, dimensions)
    home = _home(place / "home", written.home, dimensions)
    with place.complaints():
        return replace(joint, role=role, home=home, home_given=None)


def coordinate_dimension(freedom: Screw) -> Dimension:
    """What the coordinate of a freedom measures."""
    return Dimension.ANGLE if freedom.turns else Dimension.LENGTH


INERTIA_OF = {
    Dimension.ANGLE: Dimension.MOMENT_OF_INERTIA,
    Dimension.LENGTH: Dimension.MASS,
}
STIFFNESS_OF = {
    Dimension.ANGLE: Dimension.ROTATIONAL_STIFFNESS,
    Dimension.LENGTH: Dimension.TRANSLATIONAL_STIFFNESS,
}


#: What a joint is called in formulas of its force or stiffness.
_NOT_ZERO = "a joint without resistance has role: passive, a rigid drive or lock no stiffness"
_MOTION = "q"


def stiffness_law(place: Place, written: str | float, turns: bool) -> StiffnessLaw | None:
    """Stiffness by the coordinate q of its joint; None where what is written does not depend on it.

    A parameter of the name q is a number as any other.
    """
    if not isinstance(written, str) or _MOTION in place.names:
        return None
    with place.complaints():
        if _MOTION not in parse(written).names:
            return None
        import sympy as sp

        dimension = STIFFNESS_OF[Dimension.ANGLE if turns else Dimension.LENGTH]
        k = of_motion(place, written, dimension, turns)
        return StiffnessLaw.of(k, sp.Symbol(_MOTION, real=True), exact=place.is_exact)


def of_motion(place: Place, written: str, dimension: Dimension, turns: bool) -> Any:
    """What is written of the motion q, in SI units."""
    import sympy as sp

    unit = make_unit({"rad": 1} if turns else {"m": 1})
    names = {**place.names, _MOTION: make_quantity(sp.Symbol(_MOTION, real=True), unit)}
    quantity = parse(written).evaluate(names, exact_mathematics())
    return sp.sympify(to_si(quantity, dimension, got=written))


def build_role(place: Place, written: WrittenDrive, dimensions: tuple[Dimension, ...]) -> Role:
    """The role that is written at the place of a joint or a telescope."""
    _check_role(place, written, dimensions)
    stiffness = None
    if written.stiffness is not None:
        here, dimension = place / "stiffness", STIFFNESS_OF[dimensions[0]]
        turns = dimensions[0] is Dimension.ANGLE
        stiffness = stiffness_law(here, written.stiffness, turns)
        if stiffness is None:
            stiffness = here.positive(written.stiffness, dimension, _NOT_ZERO)
        elif written.role != "actuated" or written.limits is None or dimensions[1:]:
            raise here.error(
                "stiffness by the coordinate q of its joint",
                got=written.stiffness,
                expected="an actuated joint of one coordinate with limits, between which it holds",
            )
    if written.role == "passive":
        return Passive()
    if written.role == "locked":
        return Locked(stiffness)
    limits = None
    if written.limits is not None:
        low, high = vector(place / "limits", written.limits, dimensions[0])
        # Limits stay numbers: among formulas they come from the robot of numbers.
        limits = None if place.is_exact else (float(low), float(high))
    inertia = place.number_at(written, "inertia", INERTIA_OF[dimensions[0]])
    with (place / "limits").complaints():
        role = Actuated(stiffness, limits)
    with (place / "inertia").complaints():
        return replace(role, inertia=inertia or None)


def _check_role(place: Place, written: WrittenDrive, dimensions: tuple[Dimension, ...]) -> None:
    for key in ("stiffness", "limits", "inertia"):
        if getattr(written, key) is not None and len(set(dimensions)) > 1:
            raise (place / key).error(
                f"{key} of a joint that slides and turns",
                expected="no such key here",
                hint="write prismatic and revolute joints one after the other instead",
                key=True,
            )
    if written.stiffness is not None and written.role == "passive":
        raise (place / "stiffness").error(
            "stiffness of a passive joint",
            expected="no stiffness",
            hint="write role: actuated or role: locked for a joint with a stiffness",
            key=True,
        )
    for key in ("limits", "inertia"):
        if getattr(written, key) is not None and written.role != "actuated":
            raise (place / key).error(
                f"{key} of a {written.role} joint",
                expected=f"{key} of actuated joints only",
                key=True,
            )


def _home(
    place: Place, written: str | float | list | None, dimensions: tuple[Dimension, ...]
) -> tuple[Any, ...]:
    if written is None:
        return ()
    if not isinstance(written, list):
        return (place.number(written, dimensions[0]),)
    home = [
        (place / i).number(value, dimension)
        for i, (value, dimension) in enumerate(zip(written, dimensions, strict=True))
    ]
    return tuple(np.array(home).tolist())


WrittenLaw = Annotated[
    Annotated[str, Tag("text")] | Annotated[list[Pair], Field(min_length=2), Tag("table")],
    either(list, "table", "text"),
]
"""Force of a joint by its motion q: an expression, or a table of motions and forces."""


def with_written_laws(place: Place, robot: Robot, written: Mapping[str, WrittenLaw]) -> Robot:
    """The robot of numbers with the force laws that are written for ``leg/joint``.

    In these names ``*`` stands for any part.
    """
    if not written:
        return robot
    from robostiff.statics.loading.given_loads import check_own_laws

    snapshot = find_posture(robot, None).snapshot.one(0)
    joints = {f"{leg.name}/{own.name}": own for leg in snapshot.legs for own in leg.freedoms}
    laws: dict[str, ForceLaw] = {}
    for pattern, law in written.items():
        here = place / pattern
        names = [name for name in joints if fnmatchcase(name, pattern)]
        if not names:
            raise here.error(
                "joint of a law",
                got=pattern,
                expected="leg/joint, such as " + ", ".join(map(repr, list(joints)[:3])),
                key=True,
            )
        for name in names:
            own = _law(here, law, joints[name])
            with here.complaints():
                check_own_laws({name: own}, snapshot)
            laws[name] = own
    return replace(robot, laws=laws)


def _law(place: Place, written: WrittenLaw, joint: PlacedFreedom) -> ForceLaw:
    turns = joint.turns
    force = Dimension.MOMENT if turns else Dimension.FORCE
    if isinstance(written, str):
        with place.complaints():
            return ForceLaw(of_motion(place, written, force, turns))
    motion = coordinate_dimension(joint)
    table = [
        [(place / i / 0).number(q, motion), (place / i / 1).number(F, force)]
        for i, (q, F) in enumerate(written)
    ]
    with place.complaints():
        return ForceLaw(table)
