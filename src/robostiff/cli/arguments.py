"""Poses, points and wrenches as they are written on the command line."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from robostiff.cli.options import Model, Posing
from robostiff.errors import InputError, Words
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, parse_quantities
from robostiff.kinematics import ActuatorCoordinates, JointCoordinates, ToolPose, actuator_names
from robostiff.model import Actuated, Coordinate
from robostiff.spatial import Space

_DIMENSIONS = {"m": Dimension.LENGTH, "rad": Dimension.ANGLE}
_POSE_DIMENSIONS = {
    own: Dimension.LENGTH if own.value in ("x", "y", "z") else Dimension.ANGLE for own in Coordinate
}


def loaded(
    model: Model,
    place: Posing | None = None,
    *,
    by_joints: bool = False,
    moved: Mapping[str, str] | None = None,
) -> Any:
    """The robot of a name or file; its linkage where joints move a network, or legs `by_joints`.

    Without a place, as for maps and views, a network is to be moved; parameters are `moved`, too.
    """
    robot = model.load(moved)
    is_moved = place is None or place.joints is not None or place.pose is not None
    if is_moved and (robot.is_frozen or by_joints):
        from robostiff.robots.descriptions import describes_bodies, load_linkage

        # an arm has its joints as they are
        if describes_bodies(model.source) and not getattr(robot, "is_serial", False):
            parameters, options = {**model.parameters, **(moved or {})}, model.files
            return load_linkage(model.source, parameters, **options)
    return robot


def check_kind(machine: Any, kinds: Collection[str], subject: str, **words: Any) -> None:
    """Raise an InputError, with these words, where a machine is of none of these kinds."""
    if machine.kind not in kinds:
        raise InputError(subject, got=Words(f"a {machine.kind}"), **words)


def pose(robot: Any, place: Posing) -> Any:
    """The pose of a machine of any kind, as the library takes it; None for its own."""
    if place.pose is not None and place.joints is not None:
        raise InputError("--pose and --joints", expected="one of them")
    given = place.joints if place.pose is None else place.pose
    if given is None:
        return None
    option = "--joints" if place.pose is None else "--pose"
    if robot.is_frozen:
        expected = f"none: a {robot.kind} is frozen at its own pose"
        hint = "describe the robot in a model file to move it"
        raise InputError(option, got=given, expected=expected, hint=hint)
    readers = {"robot": _joints, "linkage": _joints_of_linkage}
    if option == "--joints":
        if robot.kind not in readers:
            raise InputError(option, got=given, expected="--pose: cables have no joints")
        return readers[robot.kind](robot, given)
    if not (robot.coordinates or hasattr(robot, "legs")):
        expected = f"--joints: a {robot.kind} is moved by its joints"
        raise InputError(option, got=given, expected=expected)
    if given.split()[:1] == ["tip"]:
        return _tool_pose(given)
    return np.array(_pose_coordinates(robot.coordinates, given))


def six_coordinates(text: str, option: str) -> list[float]:
    """A place and a rotation vector (6,) [m, rad]."""
    return _read_coordinates(tuple(Coordinate), text, option)


def length_and_angle(text: str, option: str) -> list[float]:
    """A length and an angle (2,) [m, rad]."""
    return parse_quantities(text, [*_DIMENSIONS.values()], ["length", "angle"], option)


_TOOL_POSE = re.compile(r"\s*tip\s(?P<tip>.+?)\saxis\s(?P<axis>.+?)(?:\sspin\s(?P<spin>.+))?\s*$")


def _tool_pose(text: str) -> ToolPose:
    """Tip and axis of the tool, and the turn about it: ``tip 0.1 0 -1.6 axis 0 0.1 1``."""
    found = _TOOL_POSE.match(text)
    if found is None:
        raise InputError("--pose", got=text, expected="tip x y z axis i j k, or with spin ANGLE")
    tip = three_lengths(found["tip"], "--pose tip")
    numbers = [Dimension.NUMBER] * 3
    axis = parse_quantities(found["axis"], numbers, ["i", "j", "k"], "--pose axis")
    if found["spin"] is None:
        return ToolPose(tip, axis)
    (spin,) = parse_quantities(found["spin"], [Dimension.ANGLE], ["spin"], "--pose spin")
    return ToolPose(tip, axis, spin=spin)


def _pose_coordinates(free: Sequence[Coordinate], text: str) -> list[float]:
    """All six coordinates, or the free ones if their number matches."""
    if len(free) in (0, len(Coordinate)):
        return _read_coordinates(tuple(Coordinate), text)
    try:
        return _read_coordinates(free, text)
    except InputError as of_free:
        try:
            return _read_coordinates(tuple(Coordinate), text)
        except InputError:
            if of_free.subject != "--pose":
                raise of_free from None
            names = " ".join(coordinate.value for coordinate in free)
            expected = f"{len(free)} numbers ({names}) or 6 (x y z rx ry rz)"
            raise InputError("--pose", got=text, expected=expected) from None


def _read_coordinates(
    coordinates: Sequence[Coordinate], text: str, option: str = "--pose"
) -> list[float]:
    dimensions = [_POSE_DIMENSIONS[coordinate] for coordinate in coordinates]
    return parse_quantities(text, dimensions, [c.value for c in coordinates], option)


def _joints(robot: Any, text: str) -> JointCoordinates | ActuatorCoordinates:
    """All joint coordinates of a serial arm; those of the actuators of any other robot."""
    every, names = _dimensions(robot), list(actuator_names(robot))
    if "=" in text:
        found = _by_name(text, {name: [own] for name, own in every.items()}, names)
        return ActuatorCoordinates({name: own[0] for name, own in found.items()})
    if robot.is_serial and not robot.legs[0].chain.has_blocks:
        return JointCoordinates(_leg_coordinates(robot, text, "--joints"))
    values = parse_quantities(text, [every[name] for name in names], names, "--joints")
    return ActuatorCoordinates(values)


def _by_name(
    text: str, units: Mapping[str, Sequence[Dimension]], names: Iterable[str]
) -> dict[str, list[float]]:
    """Coordinates of some joints, ``NAME=VALUE, NAME=VALUE``."""
    names, found = list(names), {}
    for part in text.split(","):
        name, equals, value = (one.strip() for one in part.partition("="))
        if not equals or name not in names or name in found:
            raise InputError(
                "--joints",
                got=part.strip(),
                expected=f"NAME=VALUE, each name once: {', '.join(names)}",
                hint=did_you_mean(name, names),
            )
        found[name] = parse_quantities(value, units[name], [name] * len(units[name]), "--joints")
    return found


def _joints_of_linkage(linkage: Any, text: str) -> dict[str, Any]:
    """Coordinates of some joints by name, or of all actuated ones."""
    units = {joint.name: [_DIMENSIONS[s.unit] for s in joint.freedoms] for joint in linkage.joints}
    if "=" in text:
        found = _by_name(text, units, units)
    else:
        driven = {j.name: units[j.name] for j in linkage.joints if isinstance(j.role, Actuated)}
        words = [name for name, own in driven.items() for _ in own]
        dimensions = [dimension for own in driven.values() for dimension in own]
        each = iter(parse_quantities(text, dimensions, words, "--joints"))
        found = {name: [next(each) for _ in own] for name, own in driven.items()}
    return {name: own[0] if len(own) == 1 else own for name, own in found.items()}


def gravity(text: str | None) -> str | list[float] | None:
    """Acceleration of free fall, as three numbers or the name of an axis."""
    if text is None or text.strip().lstrip("+-") in {"x", "y", "z"}:
        return text
    return parse_quantities(text, [Dimension.ACCELERATION] * 3, ["gx", "gy", "gz"], "--gravity")


def near(robot: Any, place: Posing) -> list[float] | None:
    """Joint coordinates that choose a posture."""
    if place.near is None:
        return None
    if robot.is_frozen or not hasattr(robot, "legs"):
        expected = "none: only robots of joints and legs have postures"
        raise InputError("--near", got=place.near, expected=expected)
    return _leg_coordinates(robot, place.near, "--near")


def _leg_coordinates(robot: Any, text: str, option: str) -> list[float]:
    """Coordinates of all legs, one after the other."""
    every = _dimensions(robot)
    return parse_quantities(text, list(every.values()), list(every), option)


def _dimensions(robot: Any) -> dict[str, Dimension]:
    """What each coordinate of all legs measures, by its name."""
    return {
        name if robot.is_serial else f"{leg.name}/{name}": _DIMENSIONS[screw.unit]
        for leg in robot.legs
        for screw, name in zip(leg.chain.freedoms, leg.chain.coordinate_names, strict=True)
    }


def point(place: Posing) -> list[float] | None:
    """The given point, or None for the robot's own."""
    return None if place.at is None else three_lengths(place.at, "--at")


def three_lengths(text: str, option: str) -> list[float]:
    """A place (3,) [m]."""
    return parse_quantities(text, [Dimension.LENGTH] * 3, ["x", "y", "z"], option)


def force(text: str, option: str) -> list[float]:
    """A force (3,) [N]."""
    return parse_quantities(text, [Dimension.FORCE] * 3, ["Fx", "Fy", "Fz"], option)


def wrench(text: str | None, space: Space, option: str = "--wrench") -> Any:
    """A load, from forces and moments with units; None without one."""
    if text is None:
        return None
    return parse_quantities(text, load_dimensions(space), space.wrench_order, option)


def load_dimensions(space: Space) -> list[Dimension]:
    """What each component of a wrench measures."""
    return [Dimension.FORCE if u == "N" else Dimension.MOMENT for u in space.wrench_units]


def length(text: str | None, option: str = "--length") -> float | None:
    """A length; None without one."""
    name = option.removeprefix("--")
    return None if text is None else parse_quantities(text, [Dimension.LENGTH], [name], option)[0]


def where(robot: Any, place: Posing) -> dict[str, Any]:
    """Pose, point and posture, as `robostiff.stiffness` takes them."""
    return {"pose": pose(robot, place), "at": point(place), "near": near(robot, place)}


_Chosen = TypeVar("_Chosen")


def chosen(option: str, name: str, allowed: Mapping[str, _Chosen]) -> _Chosen:
    """What a name stands for.

    Raises InputError when it is none of those allowed.
    """
    if name not in allowed:
        expected, hint = ", ".join(allowed), did_you_mean(name, tuple(allowed))
        raise InputError(option, got=name, expected=expected, hint=hint)
    return allowed[name]
