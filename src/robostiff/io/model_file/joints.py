"""Joints in a model file: the keys of each kind, its freedoms, its role, and laws of force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Tag

from robostiff.io.expression import exact_mathematics, parse
from robostiff.io.model_file.place import (
    Direction,
    Name,
    Pair,
    Place,
    Value,
    Vector,
    WrittenMapping,
    either,
)
from robostiff.io.units import Dimension, make_quantity, make_unit, to_si
from robostiff.model import (
    Actuated,
    ForceLaw,
    Joint,
    Locked,
    Passive,
    PlacedFreedom,
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


def coordinate_dimension(freedom: Screw) -> Dimension:
    """What the coordinate of a freedom measures."""
    return Dimension.ANGLE if freedom.turns else Dimension.LENGTH


INERTIA_OF = {Dimension.ANGLE: Dimension.MOMENT_OF_INERTIA, Dimension.LENGTH: Dimension.MASS}
STIFFNESS_OF = {
    Dimension.ANGLE: Dimension.ROTATIONAL_STIFFNESS,
    Dimension.LENGTH: Dimension.TRANSLATIONAL_STIFFNESS,
}


_NOT_ZERO = "a joint without resistance has role: passive, a rigid drive or lock no stiffness"
#: What the coordinate of a joint is called in formulas of its force or stiffness.
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

    def build_role(self, place: Place, dimensions: tuple[Dimension, ...]) -> Role:
        """The role of what has coordinates of these dimensions."""
        self._check_keys(place, dimensions)
        stiffness = None
        if self.stiffness is not None:
            here, dimension = place / "stiffness", STIFFNESS_OF[dimensions[0]]
            turns = dimensions[0] is Dimension.ANGLE
            stiffness = stiffness_law(here, self.stiffness, turns)
            if stiffness is None:
                stiffness = here.number(self.stiffness, dimension, positive=True, hint=_NOT_ZERO)
            elif self.role != "actuated" or self.limits is None or dimensions[1:]:
                raise here.error(
                    "stiffness by the coordinate q of its joint",
                    got=self.stiffness,
                    expected="an actuated joint of one coordinate with limits, between which it "
                    "holds",
                )
        if self.role == "passive":
            return Passive()
        if self.role == "locked":
            return Locked(stiffness)
        limits = None
        if self.limits is not None:
            low, high = (place / "limits").plain_vector(self.limits, dimensions[0])
            limits = low, high
        inertia = place.number_at(self, "inertia", INERTIA_OF[dimensions[0]])
        with (place / "limits").complaints():
            role = Actuated(stiffness, limits)
        with (place / "inertia").complaints():
            return replace(role, inertia=inertia or None)

    def _check_keys(self, place: Place, dimensions: tuple[Dimension, ...]) -> None:
        for key in ("stiffness", "limits", "inertia"):
            if getattr(self, key) is not None and len(set(dimensions)) > 1:
                raise (place / key).error(
                    f"{key} of a joint that slides and turns",
                    expected="no such key here",
                    hint="write prismatic and revolute joints one after the other instead",
                    key=True,
                )
        if self.stiffness is not None and self.role == "passive":
            hint = "write role: actuated or role: locked for a joint with a stiffness"
            raise (place / "stiffness").error(
                "stiffness of a passive joint", expected="no stiffness", hint=hint, key=True
            )
        for key in ("limits", "inertia"):
            if getattr(self, key) is not None and self.role != "actuated":
                raise (place / key).error(
                    f"{key} of a {self.role} joint",
                    expected=f"{key} of actuated joints only",
                    key=True,
                )


#: What makes joints of each kind, of directions and a pitch.
MAKERS: dict[str, Callable[..., Joint]] = {
    **{"revolute": revolute, "prismatic": prismatic, "helical": helical, "universal": universal},
    **{"spherical": spherical, "cylindrical": cylindrical, "planar": planar},
}


class WrittenBaseJoint(WrittenDrive):
    """A joint, of any kind."""

    home: Any = None

    def build(self, place: Place, name: str) -> Joint:
        """The joint."""
        written = vars(self)
        axes = [(place / key, written[key]) for key in ("axis", "normal") if key in written]
        axes += [(place / "axes" / i, axis) for i, axis in enumerate(written.get("axes", ()))]
        arguments: list[Any] = [here.direction(axis) for here, axis in axes]
        if "pitch" in written:
            pitch = (place / "pitch").number(written["pitch"], Dimension.ADVANCE_PER_TURN)
            arguments.append(pitch)
        with place.complaints():
            joint = MAKERS[written["type"]](*arguments, Passive(), name=name)
        dimensions = tuple(map(coordinate_dimension, joint.freedoms))
        role = self.build_role(place, dimensions)
        here, home = place / "home", ()
        if isinstance(self.home, list):
            pairs = enumerate(zip(self.home, dimensions, strict=True))
            home = tuple(np.array([(here / i).number(*pair) for i, pair in pairs]).tolist())
        elif self.home is not None:
            home = (here.number(self.home, dimensions[0]),)
        with place.complaints():
            return replace(joint, role=role, home=home, home_given=None)


_Axis = Annotated[Direction, Field(description="the axis, such as z or [0, 0, 1]")]


class WrittenOneAxisJoint(WrittenBaseJoint):
    """Revolute or prismatic joint."""

    type: Literal["revolute", "prismatic"]
    axis: _Axis
    home: Value | None = None


class WrittenHelical(WrittenBaseJoint):
    """Helical joint."""

    type: Literal["helical"]
    axis: _Axis
    pitch: Value = Field(
        description="the advance along the axis in one full turn, such as 5 mm; negative for a "
        "left-handed screw"
    )
    home: Value | None = None


class WrittenUniversal(WrittenBaseJoint):
    """Universal joint."""

    type: Literal["universal"]
    axes: Annotated[list[Direction], Field(min_length=2, max_length=2)] = Field(
        description="the two axes, such as [x, y], the one at the base side first"
    )
    home: Pair | None = None


class WrittenSpherical(WrittenBaseJoint):
    """Spherical joint."""

    type: Literal["spherical"]
    home: Vector | None = None


class WrittenCylindrical(WrittenBaseJoint):
    """Cylindrical joint."""

    type: Literal["cylindrical"]
    axis: _Axis
    home: Pair | None = None


class WrittenPlanar(WrittenBaseJoint):
    """Planar joint."""

    type: Literal["planar"]
    normal: Direction = Field(description="the direction across the plane, such as z")
    home: Vector | None = None


WrittenJoint = (
    WrittenOneAxisJoint
    | WrittenHelical
    | WrittenUniversal
    | WrittenSpherical
    | WrittenCylindrical
    | WrittenPlanar
)


WrittenLaw = Annotated[
    Annotated[str, Tag("text")] | Annotated[list[Pair], Field(min_length=2), Tag("table")],
    either(list, "table", "text"),
]
"""Force of a joint by its motion q: an expression, or a table of motions and forces."""


def build_law(place: Place, written: WrittenLaw, joint: PlacedFreedom) -> ForceLaw:
    """The force law of a joint that is written at a place."""
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
