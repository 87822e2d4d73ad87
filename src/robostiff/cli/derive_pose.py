"""The pose of a formula, from the command line."""

from __future__ import annotations

from robostiff.analytic import AtCoordinates, AtHome, AtSymbols
from robostiff.analytic.robot_pose import PoseFormula, coordinate_names
from robostiff.errors import InputError
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model import Motion, Robot


def pose_from(text: str, robot: Robot) -> PoseFormula:
    """Read ``home``, ``symbolic``, or coordinates such as ``x=100 mm, gamma=10 deg``.

    Raises
    ------
    InputError
        When it is none of them, or a name is no coordinate of the robot.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> pose_from("x = 100 mm", load("3-rpr"))
    AtCoordinates(values={'x': 0.1})
    """
    word = text.strip()
    if word == "home":
        return AtHome()
    if word == "symbolic":
        return AtSymbols()
    names = coordinate_names(robot)
    values: dict[str, float] = {}
    for part in word.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not (name and equals and value):
            raise InputError(
                "--pose",
                got=text,
                expected="home, symbolic, or coordinates NAME=VALUE with commas between them",
                hint=f'write --pose "{names[0]}=0.1"' if names else None,
            )
        if name not in names:
            raise InputError(
                f"--pose, coordinate of {robot.name!r}", got=name, expected=", ".join(names)
            )
        if name in values:
            raise InputError("--pose", got=text, expected=f"one value for {name}")
        dimension = _dimension(robot, name)
        (values[name],) = parse_quantities(value, [dimension], [name], f"--pose {name}")
    return AtCoordinates(values)


def _dimension(robot: Robot, name: str) -> Dimension:
    if name.startswith("q"):
        freedom = robot.legs[0].chain.freedoms[int(name[1:]) - 1]
        slides = freedom.motion is Motion.TRANSLATION
        return Dimension.LENGTH if slides else Dimension.ANGLE
    return Dimension.LENGTH if name in ("x", "y", "z") else Dimension.ANGLE
