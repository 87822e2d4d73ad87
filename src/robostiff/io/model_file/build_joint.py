"""From a written joint to a joint of the model."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from robostiff.io.model_file.build_laws import stiffness_law
from robostiff.io.model_file.geometry import direction, vector
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_elements import (
    WrittenCylindrical,
    WrittenDrive,
    WrittenHelical,
    WrittenJoint,
    WrittenOneAxisJoint,
    WrittenPlanar,
    WrittenUniversal,
)
from robostiff.io.units import Dimension
from robostiff.model import (
    Actuated,
    Joint,
    Locked,
    Passive,
    Role,
    cylindrical,
    helical,
    planar,
    prismatic,
    revolute,
    spherical,
    universal,
)

_STIFFNESS_OF = {
    Dimension.ANGLE: Dimension.ROTATIONAL_STIFFNESS,
    Dimension.LENGTH: Dimension.TRANSLATIONAL_STIFFNESS,
}


def build_joint(place: Place, written: WrittenJoint, name: str) -> Joint:
    """The joint that is written at a place."""
    dimensions = coordinate_dimensions(written)
    role = build_role(place, written, dimensions)
    home = _home(place / "home", written.home, dimensions)
    match written:
        case WrittenOneAxisJoint():
            make = revolute if written.type == "revolute" else prismatic
            construct = partial(make, direction(place / "axis", written.axis))
        case WrittenHelical():
            pitch = (place / "pitch").number(written.pitch, Dimension.ADVANCE_PER_TURN)
            construct = partial(helical, direction(place / "axis", written.axis), pitch)
        case WrittenUniversal():
            places = [place / "axes" / i for i in range(2)]
            axes = map(direction, places, written.axes)
            construct = partial(universal, *(axis.tolist() for axis in axes))
        case WrittenCylindrical():
            construct = partial(cylindrical, direction(place / "axis", written.axis))
        case WrittenPlanar():
            construct = partial(planar, direction(place / "normal", written.normal))
        case _:
            construct = spherical
    with place.complaints():
        return construct(role, home=home, name=name)


def coordinate_dimensions(written: WrittenJoint) -> tuple[Dimension, ...]:
    """What the coordinates of a joint measure."""
    slide, turn = Dimension.LENGTH, Dimension.ANGLE
    return {
        "revolute": (turn,),
        "prismatic": (slide,),
        "helical": (turn,),
        "universal": (turn, turn),
        "spherical": (turn, turn, turn),
        "cylindrical": (slide, turn),
        "planar": (slide, slide, turn),
    }[written.type]


def build_role(place: Place, written: WrittenDrive, dimensions: tuple[Dimension, ...]) -> Role:
    """The role that is written at the place of a joint or a telescope."""
    _check_role(place, written, dimensions)
    stiffness = None
    if written.stiffness is not None:
        here, dimension = place / "stiffness", _STIFFNESS_OF[dimensions[0]]
        turns = dimensions[0] is Dimension.ANGLE
        stiffness = stiffness_law(here, written.stiffness, turns)
        if stiffness is None:
            stiffness = here.positive(written.stiffness, dimension)
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
    with (place / "limits").complaints():
        return Actuated(stiffness, limits)


def _check_role(place: Place, written: WrittenDrive, dimensions: tuple[Dimension, ...]) -> None:
    for key in ("stiffness", "limits"):
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
    if written.limits is not None and written.role != "actuated":
        raise (place / "limits").error(
            f"limits of a {written.role} joint",
            expected="limits of actuated joints only",
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
