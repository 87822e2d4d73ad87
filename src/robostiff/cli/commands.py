"""What the commands do, once the command line is understood."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import typer

from robostiff.analysis import CableStiffness, RobotStiffness, deflection, stiffness
from robostiff.cli import tables
from robostiff.cli.failure import BAD_STATUS
from robostiff.cli.network_facts import network_facts
from robostiff.cli.platform_facts import platform_facts
from robostiff.elastostatics import (
    Block,
    Form,
    IndexRules,
    Recursive,
    SaddlePoint,
    WrenchBasis,
)
from robostiff.errors import InputError
from robostiff.io.results import (
    deflection_data,
    deflection_text,
    stiffness_data,
    stiffness_text,
)
from robostiff.io.suggest import did_you_mean
from robostiff.io.units import Dimension, parse_quantities
from robostiff.kinematics import JointCoordinates, Pose
from robostiff.model import (
    Actuated,
    Coordinate,
    Joint,
    Motion,
    ParallelBlock,
    Passive,
    PlacedBlock,
    PlacedElement,
    Robot,
    Snapshot,
)
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.robots import describe, load, shipped_cable_robots, shipped_linkages, shipped_robots
from robostiff.spatial import Space

METHODS: dict[str, Form] = {
    form.name: form for form in (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
}


@dataclass(frozen=True)
class Place:
    """Where the robot stands and about which point, as written on the command line."""

    pose: str | None
    joints: str | None
    at: str | None


def list_robots(as_json: bool) -> int:
    """Print the shipped robots."""
    names = (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    listed = {name: describe(name) for name in sorted(names)}
    if as_json:
        robots = [
            {"name": name, "title": d.title, "source": d.source} for name, d in listed.items()
        ]
        _print_json({"robots": robots})
    else:
        tables.print_robots(listed)
    return 0


def check_robot(
    source: str, settings: Sequence[str], as_json: bool, side: str | None = None
) -> int:
    """Print what a robot consists of; reading it is the check."""
    robot = load(source, parameters_from(settings), side=side)
    if isinstance(robot, CableRobot):
        from robostiff.cli.commands_cables import cable_robot_facts

        facts = cable_robot_facts(robot)
    elif isinstance(robot, Network):
        facts = {**network_facts(robot), "home": _home_facts(stiffness(robot))}
    else:
        facts = _snapshot_facts(robot) if isinstance(robot, Snapshot) else _robot_facts(robot)
    if as_json:
        _print_json(facts)
    else:
        tables.print_facts(facts)
    return 0


def print_stiffness(
    source: str,
    place: Place,
    method: str,
    settings: Sequence[str],
    as_json: bool,
    side: str | None = None,
) -> int:
    """Print K at a pose."""
    form = _method(method)
    robot = load(source, parameters_from(settings), side=side)
    result = stiffness(robot, pose_from(robot, place), method=form, at=point_from(place))
    if isinstance(result, CableStiffness):
        from robostiff.cli.commands_cables import print_cable_stiffness

        return print_cable_stiffness(result, as_json)
    if as_json:
        _print_json(stiffness_data(result))
    elif tables.on_terminal():
        tables.print_stiffness(result)
    else:
        typer.echo(stiffness_text(result))
    return BAD_STATUS if result.status.is_bad else 0


def print_deflection(
    source: str,
    place: Place,
    wrench: str,
    settings: Sequence[str],
    as_json: bool,
    side: str | None = None,
) -> int:
    """Print the deflection under a load."""
    robot = load(source, parameters_from(settings), side=side)
    F = wrench_from(wrench, robot.space)
    result = deflection(robot, pose_from(robot, place), F, at=point_from(place))
    if as_json:
        _print_json(deflection_data(result))
    elif tables.on_terminal():
        tables.print_deflection(result)
    else:
        typer.echo(deflection_text(result))
    return BAD_STATUS if result.status.is_bad else 0


def _method(name: str) -> Form:
    if name not in METHODS:
        raise InputError(
            "--method",
            got=name,
            expected=", ".join(METHODS),
            hint=did_you_mean(name, METHODS),
        )
    return METHODS[name]


def parameters_from(settings: Sequence[str]) -> dict[str, str]:
    """Parameters of a model file, from ``NAME=VALUE``."""
    parameters = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise InputError("--set", got=setting, expected="NAME=VALUE, such as R=350mm")
        if name.strip() in parameters:
            raise InputError("--set", got=setting, expected=f"one value for {name.strip()}")
        parameters[name.strip()] = value.strip()
    return parameters


_POSE_DIMENSIONS = {
    Coordinate.X: Dimension.LENGTH,
    Coordinate.Y: Dimension.LENGTH,
    Coordinate.Z: Dimension.LENGTH,
    Coordinate.RX: Dimension.ANGLE,
    Coordinate.RY: Dimension.ANGLE,
    Coordinate.RZ: Dimension.ANGLE,
}


def pose_from(robot: Robot | Snapshot | Network | CableRobot, place: Place) -> Pose:
    """Where the robot stands."""
    if place.pose is not None and place.joints is not None:
        raise InputError("--pose and --joints", expected="one of them")
    if isinstance(robot, Snapshot | Network):
        kind = "network" if isinstance(robot, Network) else "snapshot"
        if place.pose is not None or place.joints is not None:
            raise InputError(
                "--pose" if place.pose is not None else "--joints",
                got=place.pose or place.joints,
                expected=f"none: a {kind} is frozen at its own pose",
                hint="describe the robot in a model file to move it",
            )
        return None
    if isinstance(robot, CableRobot):
        if place.joints is not None:
            raise InputError("--joints", got=place.joints, expected="--pose: cables have no joints")
        return None if place.pose is None else np.array(_pose_coordinates(robot, place.pose))
    if place.joints is not None:
        return JointCoordinates(_joints(robot, place.joints))
    if place.pose is None:
        return None
    return np.array(_pose_coordinates(robot, place.pose))


def _pose_coordinates(robot: Robot | CableRobot, text: str) -> list[float]:
    """All six coordinates, or the free ones when there are as many numbers as those."""
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


def _joints(robot: Robot, text: str) -> list[float]:
    if not robot.is_serial:
        raise InputError(
            "--joints", got=text, expected="--pose: joints pose serial arms only", hint=None
        )
    dimensions, names = [], []
    for element, _ in robot.legs[0].chain.moving:
        motions = (
            [freedom.motion for freedom in element.freedoms]
            if isinstance(element, Joint)
            else [Motion.TRANSLATION]
        )
        for motion in motions:
            slides = motion is Motion.TRANSLATION
            dimensions.append(Dimension.LENGTH if slides else Dimension.ANGLE)
            names.append(element.name)
    return parse_quantities(text, dimensions, names, "--joints")


def point_from(place: Place) -> list[float] | None:
    """The point asked for, or None for the robot's own."""
    if place.at is None:
        return None
    return parse_quantities(place.at, [Dimension.LENGTH] * 3, ["x", "y", "z"], "--at")


def wrench_from(text: str, space: Space) -> list[float]:
    """A load, from forces and moments with units."""
    dimensions = [Dimension.FORCE] * space.translations
    dimensions += [Dimension.MOMENT] * (space.size - space.translations)
    return parse_quantities(text, dimensions, space.wrench_order, "--wrench")


def _robot_facts(robot: Robot) -> dict[str, Any]:
    home = stiffness(robot)
    of_platform = {} if robot.platform is None else {"platform": platform_facts(robot)}
    return {
        "name": robot.name,
        "kind": "model",
        "title": robot.title,
        "source": robot.source,
        "space": robot.space.name.lower(),
        "coordinates": [coordinate.value for coordinate in robot.coordinates],
        "legs": [
            {
                "name": leg.name,
                "elements": [_element_words(element) for element in leg.chain.elements],
                "passive_freedoms": sum(isinstance(r, Passive) for r in leg.chain.roles),
                "actuated_freedoms": sum(isinstance(r, Actuated) for r in leg.chain.roles),
            }
            for leg in robot.legs
        ],
        **of_platform,
        "home": _home_facts(home),
    }


def _snapshot_facts(snapshot: Snapshot) -> dict[str, Any]:
    return {
        "name": snapshot.name,
        "kind": "snapshot",
        "title": snapshot.description,
        "source": "",
        "space": snapshot.space.name.lower(),
        "coordinates": [],
        "legs": [
            {
                "name": leg.name,
                "elements": [_placed_words(element) for element in leg.elements],
                "passive_freedoms": sum(freedom.is_passive for freedom in leg.freedoms),
                "actuated_freedoms": sum(not freedom.is_passive for freedom in leg.freedoms),
            }
            for leg in snapshot.legs
        ],
        "home": _home_facts(stiffness(snapshot)),
    }


def _home_facts(home: RobotStiffness) -> dict[str, Any]:
    return {
        "status": str(home.status),
        "rank": int(home.rank),
        "free_motions": [str(motion) for motion in home.free_motions],
        "advice": list(home.advice),
    }


def _element_words(element: Any) -> str:
    """Name and role of an element; a parallel block with what is inside."""
    if isinstance(element, ParallelBlock):
        insides = [map(_element_words, branch.chain.elements) for branch in element.branches]
        return _block_words(element.name, insides)
    role = getattr(element, "role", None)
    if role is None:
        return str(element.name)
    return f"{element.name} ({type(role).__name__.lower()})"


def _placed_words(element: PlacedElement, prefix: str = "") -> str:
    """Name of an element of a snapshot, without those of the blocks around it."""
    name = element.name.removeprefix(prefix)
    if not isinstance(element, PlacedBlock):
        return name
    insides = [
        [_placed_words(inner, f"{branch.name}/") for inner in branch.elements]
        for branch in element.branches
    ]
    return _block_words(name, insides)


def _block_words(name: str, insides: Iterable[Iterable[str]]) -> str:
    """A parallel block; branches that read alike are told once."""
    told = ["[" + ", ".join(words) + "]" for words in insides]
    return f"{name} " + (f"{len(told)} x {told[0]}" if len(set(told)) == 1 else " | ".join(told))


def _print_json(data: Any) -> None:
    typer.echo(json.dumps(data, indent=1, allow_nan=False))
