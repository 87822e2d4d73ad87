"""From written joints, force laws and couplings to those of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robostiff.errors import InputError
from robostiff.io.expression import exact_mathematics, parse
from robostiff.io.model_file.place import Place, direction, vector
from robostiff.io.model_file.written_elements import (
    WrittenCoupling,
    WrittenCylindrical,
    WrittenDrive,
    WrittenFollower,
    WrittenHelical,
    WrittenJoint,
    WrittenOneAxisJoint,
    WrittenPlanar,
    WrittenSum,
    WrittenUniversal,
)
from robostiff.io.model_file.written_robot import WrittenLaw
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, make_quantity, make_unit, to_si
from robostiff.kinematics import find_posture
from robostiff.model import (
    Actuated,
    Chain,
    Coupling,
    Element,
    ForceLaw,
    Joint,
    Locked,
    Passive,
    PlacedFreedom,
    Robot,
    Role,
    StiffnessLaw,
    coupling,
    cylindrical,
    helical,
    planar,
    prismatic,
    revolute,
    spherical,
    universal,
)

if TYPE_CHECKING:
    from robostiff.model import Actuated, Locked

#: What a joint is called in formulas of its force or stiffness.
_MOTION = "q"


def stiffness_law(place: Place, written: str | float, turns: bool) -> StiffnessLaw | None:
    """Stiffness by the coordinate q of its joint; None where what is written does not depend on it.

    A parameter of the name q is a number as any other.
    """
    if not isinstance(written, str) or _MOTION in place.names:
        return None
    with place.complaints():
        expression = parse(written)
        if _MOTION not in expression.names:
            return None
        import sympy as sp

        k = _of_motion(
            place,
            written,
            Dimension.ROTATIONAL_STIFFNESS if turns else Dimension.TRANSLATIONAL_STIFFNESS,
            turns,
        )
        return StiffnessLaw.of(k, sp.Symbol(_MOTION, real=True), exact=place.is_exact)


def _of_motion(place: Place, written: str, dimension: Dimension, turns: bool) -> Any:
    """What is written of the motion q, in SI units."""
    import sympy as sp

    unit = make_unit({"rad": 1} if turns else {"m": 1})
    names = {**place.names, _MOTION: make_quantity(sp.Symbol(_MOTION, real=True), unit)}
    quantity = parse(written).evaluate(names, exact_mathematics())
    return sp.sympify(to_si(quantity, dimension, got=written))


def with_written_laws(place: Place, robot: Robot, written: Mapping[str, WrittenLaw]) -> Robot:
    """The robot with the force laws that are written for its joints.

    Parameters
    ----------
    place : Place
    robot : Robot
        Of numbers.
    written : mapping of str to expression or table
        By ``leg/joint``; ``*`` stands for any part of a name.
    """
    if not written:
        return robot
    from robostiff.statics.joint_laws import check_own_laws

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
            return ForceLaw(_of_motion(place, written, force, turns))
    motion = Dimension.ANGLE if turns else Dimension.LENGTH
    table = [
        [(place / i / 0).number(q, motion), (place / i / 1).number(F, force)]
        for i, (q, F) in enumerate(written)
    ]
    with place.complaints():
        return ForceLaw(table)


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


_TURN, _SLIDE = Dimension.ANGLE, Dimension.LENGTH


def coupled_chain(
    elements: Sequence[Element], place: Place, written: Sequence[WrittenCoupling]
) -> Chain:
    """The chain of elements with the couplings that are written at a place."""
    joints = {own.name: own for own in elements if isinstance(own, Joint) and own.size == 1}
    built = tuple(
        _follower(place / i, own, joints)
        if isinstance(own, WrittenFollower)
        else _sum(place / i, own, joints)
        for i, own in enumerate(written)
    )
    try:
        return Chain(tuple(elements), built)
    except InputError:
        for i in range(len(built)):  # one after the other, so that an error is at its own place
            with (place / i).complaints():
                Chain(tuple(elements), built[: i + 1])
        raise


def _follower(place: Place, written: WrittenFollower, joints: dict[str, Joint]) -> Coupling:
    own = _slides(place / "joint", written.joint, joints)
    leader = _slides(place / "follows", written.follows, joints)
    if leader and not own:
        raise (place / "joint").error(
            f"joint {written.joint!r}, which turns and follows a slide",
            expected="a slide that follows a turn",
            hint=f"write joint: {written.follows}, follows: {written.joint}, with the advance for "
            "one radian as the ratio",
        )
    per = _SLIDE if own and not leader else Dimension.NUMBER
    ratio = (place / "ratio").number(written.ratio, per)
    offset = (place / "offset").number(written.offset, _SLIDE if own else _TURN)
    drive = WrittenDrive(role="locked", stiffness=written.stiffness)
    role = cast("Locked", build_role(place, drive, (_SLIDE if own else _TURN,)))
    name = written.name or ""
    with (place / "ratio").complaints():
        found = coupling(
            written.joint, follows=written.follows, ratio=ratio, offset=offset, name=name
        )
    return Coupling(found.terms, role, found.home, found.name)


def _sum(place: Place, written: WrittenSum, joints: dict[str, Joint]) -> Coupling:
    here = place / "sum"
    slides = {name: _slides(here / name, name, joints) for name in written.sum}
    of_lengths = next(iter(slides.values()))
    if not of_lengths and any(slides.values()):
        raise here.error(
            "sum of joint coordinates",
            got=list(written.sum),
            expected="a slide as the first, so that the sum is a length",
        )
    terms = []
    for name, factor in written.sum.items():
        dimension = _SLIDE if of_lengths and not slides[name] else Dimension.NUMBER
        terms.append((name, (here / name).number(factor, dimension)))
    dimension = _SLIDE if of_lengths else _TURN
    if written.equals is not None and written.role == "actuated":
        raise (place / "equals").error(
            "equals of an actuated sum",
            expected="no such key here: the drive moves the sum",
            hint="its value at home follows from the home coordinates of the joints",
            key=True,
        )
    equals = written.equals
    home = None if equals is None else (place / "equals").number(equals, dimension)
    drive = WrittenDrive(role=written.role, stiffness=written.stiffness, limits=written.limits)
    role = cast("Locked | Actuated", build_role(place, drive, (dimension,)))
    with here.complaints():
        return Coupling(tuple(terms), role, home, written.name or "")


def _slides(place: Place, name: str, joints: dict[str, Joint]) -> bool:
    """Whether a joint slides."""
    if name not in joints:
        listed = ", ".join(joints) or "none"
        raise place.error(
            "joint of a coupling",
            got=name,
            expected=f"a revolute, prismatic or helical joint of the same chain: {listed}",
            hint=did_you_mean(name, joints),
            key=place.path[-2] == "sum",
        )
    return not joints[name].freedoms[0].turns
