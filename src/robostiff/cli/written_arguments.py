"""Poses, points, loads and parameters as they are written on the command line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from robostiff.cli.options import Model, Posing
from robostiff.errors import InputError
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, parse_quantities
from robostiff.kinematics import (
    ActuatorCoordinates,
    JointCoordinates,
    Pose,
    ToolPose,
    actuator_names,
)
from robostiff.model import Actuated, Coordinate, Robot
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.linkage import Linkage
    from robostiff.model import Snapshot
    from robostiff.model.cable import CableRobot
    from robostiff.network import Network

    Posed = Robot | Snapshot | Network | Linkage | CableRobot

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
    moves = place is None or place.joints is not None or place.pose is not None
    if isinstance(robot, Robot):
        has_joints = by_joints and not robot.is_serial
    else:
        from robostiff.network import Network

        has_joints = isinstance(robot, Network)
    if not (moves and has_joints):
        return robot
    from robostiff.robots.descriptions import describes_bodies, load_linkage

    if not describes_bodies(model.source):
        return robot
    parameters = {**model.parameters, **(moved or {})}
    return load_linkage(model.source, parameters, side=model.side, allow_xacro=model.allow_xacro)


def pose_from(robot: Posed, place: Posing) -> Any:
    """The pose."""
    if place.pose is not None and place.joints is not None:
        raise InputError("--pose and --joints", expected="one of them")
    if isinstance(robot, Robot):
        return _of_robot(robot, place)
    from robostiff.linkage import Linkage

    if isinstance(robot, Linkage):
        return _of_linkage(robot, place)
    return _without_joints(robot, place)


def _without_joints(robot: Any, place: Posing) -> Pose:
    if robot.is_frozen:
        if place.pose is not None or place.joints is not None:
            raise InputError(
                "--pose" if place.pose is not None else "--joints",
                got=place.pose or place.joints,
                expected=f"none: a {robot.kind} is frozen at its own pose",
                hint="describe the robot in a model file to move it",
            )
        return None
    if place.joints is not None:
        raise InputError("--joints", got=place.joints, expected="--pose: cables have no joints")
    return None if place.pose is None else np.array(_pose_coordinates(robot, place.pose))


def _of_robot(robot: Robot, place: Posing) -> Pose:
    if place.joints is not None:
        return _joints(robot, place.joints)
    if place.pose is None:
        return None
    if place.pose.split()[:1] == ["tip"]:
        return _tool_pose(place.pose)
    return np.array(_pose_coordinates(robot, place.pose))


_TOOL_POSE = re.compile(r"\s*tip\s(?P<tip>.+?)\saxis\s(?P<axis>.+?)(?:\sspin\s(?P<spin>.+))?\s*$")


def _tool_pose(text: str) -> ToolPose:
    """Tip and axis of the tool, and the turn about it: ``tip 0.1 0 -1.6 axis 0 0.1 1``."""
    found = _TOOL_POSE.match(text)
    if found is None:
        raise InputError("--pose", got=text, expected="tip x y z axis i j k, or with spin ANGLE")
    tip = parse_quantities(found["tip"], [Dimension.LENGTH] * 3, ["x", "y", "z"], "--pose tip")
    numbers = [Dimension.NUMBER] * 3
    axis = parse_quantities(found["axis"], numbers, ["i", "j", "k"], "--pose axis")
    if found["spin"] is None:
        return ToolPose(tip, axis)
    (spin,) = parse_quantities(found["spin"], [Dimension.ANGLE], ["spin"], "--pose spin")
    return ToolPose(tip, axis, spin=spin)


def _pose_coordinates(robot: Robot | CableRobot, text: str) -> list[float]:
    """All six coordinates, or the free ones if their number matches."""
    every = tuple(_POSE_DIMENSIONS)
    if 0 < len(robot.coordinates) < 6:
        try:
            return _read_coordinates(robot.coordinates, text)
        except InputError as of_free:
            try:
                return _read_coordinates(every, text)
            except InputError:
                if of_free.subject != "--pose":
                    raise of_free from None
                names = " ".join(coordinate.value for coordinate in robot.coordinates)
                raise InputError(
                    "--pose",
                    got=text,
                    expected=f"{len(robot.coordinates)} numbers ({names}) or 6 (x y z rx ry rz)",
                ) from None
    return _read_coordinates(every, text)


def _read_coordinates(coordinates: Sequence[Coordinate], text: str) -> list[float]:
    dimensions = [_POSE_DIMENSIONS[coordinate] for coordinate in coordinates]
    return parse_quantities(text, dimensions, [c.value for c in coordinates], "--pose")


def _joints(robot: Robot, text: str) -> JointCoordinates | ActuatorCoordinates:
    """All joint coordinates of a serial arm; those of the actuators of any other robot."""
    if "=" in text:
        units = {name: [own] for name, own in _dimensions(robot).items()}
        found = _by_name(text, units, actuator_names(robot))
        return ActuatorCoordinates({name: own[0] for name, own in found.items()})
    if robot.is_serial and not robot.legs[0].chain.has_blocks:
        return JointCoordinates(_leg_coordinates(robot, text, "--joints"))
    every, names = _dimensions(robot), list(actuator_names(robot))
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


def _of_linkage(linkage: Linkage, place: Posing) -> dict[str, Any] | None:
    """Coordinates of some joints by name, or of all actuated ones."""
    if place.pose is not None:
        raise InputError(
            "--pose", got=place.pose, expected="--joints: a linkage is moved by its joints"
        )
    if place.joints is None:
        return None
    units = {joint.name: [_DIMENSIONS[s.unit] for s in joint.freedoms] for joint in linkage.joints}
    if "=" in place.joints:
        found = _by_name(place.joints, units, units)
    else:
        driven = {j.name: units[j.name] for j in linkage.joints if isinstance(j.role, Actuated)}
        words = [name for name, own in driven.items() for _ in own]
        dimensions = [dimension for own in driven.values() for dimension in own]
        each = iter(parse_quantities(place.joints, dimensions, words, "--joints"))
        found = {name: [next(each) for _ in own] for name, own in driven.items()}
    return {name: own[0] if len(own) == 1 else own for name, own in found.items()}


_DIMENSIONS = {"m": Dimension.LENGTH, "rad": Dimension.ANGLE}


def gravity_from(text: str | None) -> str | list[float] | None:
    """Acceleration of free fall, as three numbers or the name of an axis."""
    if text is None or text.strip().lstrip("+-") in {"x", "y", "z"}:
        return text
    return parse_quantities(text, [Dimension.ACCELERATION] * 3, ["gx", "gy", "gz"], "--gravity")


def near_from(robot: Posed, place: Posing) -> list[float] | None:
    """Joint coordinates that choose a posture."""
    if place.near is None:
        return None
    if not isinstance(robot, Robot):
        raise InputError(
            "--near", got=place.near, expected="none: only robots of joints and legs have postures"
        )
    return _leg_coordinates(robot, place.near, "--near")


def _leg_coordinates(robot: Robot, text: str, option: str) -> list[float]:
    """Coordinates of all legs, one after the other."""
    every = _dimensions(robot)
    return parse_quantities(text, list(every.values()), list(every), option)


def _dimensions(robot: Robot) -> dict[str, Dimension]:
    """What each coordinate of all legs measures, by its name."""
    return {
        name if robot.is_serial else f"{leg.name}/{name}": (_DIMENSIONS[screw.unit])
        for leg in robot.legs
        for screw, name in zip(leg.chain.freedoms, leg.chain.coordinate_names, strict=True)
    }


def point_from(place: Posing) -> list[float] | None:
    """The given point, or None for the robot's own."""
    if place.at is None:
        return None
    return parse_quantities(place.at, [Dimension.LENGTH] * 3, ["x", "y", "z"], "--at")


def wrench_from(text: str, space: Space, option: str = "--wrench") -> list[float]:
    """A load, from forces and moments with units."""
    return parse_quantities(text, load_dimensions(space), space.wrench_order, option)


def load_dimensions(space: Space) -> list[Dimension]:
    """What each component of a wrench measures."""
    return [Dimension.FORCE if u == "N" else Dimension.MOMENT for u in space.wrench_units]


def length_from(text: str | None) -> float | None:
    """A characteristic length, or None for that of the robot."""
    if text is None:
        return None
    return parse_quantities(text, [Dimension.LENGTH], ["length"], "--length")[0]


def where_from(robot: Posed, place: Posing) -> dict[str, Any]:
    """Pose, point and posture, as `robostiff.stiffness` takes them."""
    pose, at, near = pose_from(robot, place), point_from(place), near_from(robot, place)
    return {"pose": pose, "at": at, "near": near}


_Chosen = TypeVar("_Chosen")


def chosen(option: str, name: str, allowed: Mapping[str, _Chosen]) -> _Chosen:
    """What a name stands for.

    Raises InputError when it is none of those allowed.
    """
    if name not in allowed:
        expected, hint = ", ".join(allowed), did_you_mean(name, tuple(allowed))
        raise InputError(option, got=name, expected=expected, hint=hint)
    return allowed[name]
