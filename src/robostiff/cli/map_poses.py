"""The poses of a map, from the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robostiff.analysis.maps import Axis, Grid, RandomPoses
from robostiff.analysis.maps.pose_columns import SIX, joint_columns
from robostiff.analysis.maps.pose_source import PoseSource
from robostiff.errors import InputError
from robostiff.io.map_files import read_poses
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model import Robot


@dataclass(frozen=True)
class Asked:
    """A map as written on the command line."""

    axes: Mapping[str, str]
    joints: Sequence[str]
    poses: str | None
    random: int | None
    seed: int
    quantities: Sequence[str]
    wrench: str | None
    length: str | None


def read_asked_poses(robot: Robot, asked: Asked) -> PoseSource:
    """Grid, list or random poses, as asked for."""
    if asked.poses is not None:
        if asked.axes or asked.joints or asked.random is not None:
            raise InputError(
                "--poses", got=asked.poses, expected="no --x, --joint or --random beside it"
            )
        return read_poses(robot, asked.poses)
    random = asked.random is not None
    words = ["start", "stop"] if random else ["start", "stop", "count"]
    found: dict[str, list[float]] = {}
    for name, text in asked.axes.items():
        dimension = Dimension.LENGTH if SIX.index(name) < 3 else Dimension.ANGLE
        found[name] = _numbers(text, dimension, words, f"--{name}")
    for text in asked.joints:
        name, dimension, rest = _joint(robot, text)
        if name in found:
            raise InputError("--joint", got=text, expected=f"one range for {name}")
        found[name] = _numbers(rest, dimension, words, f"--joint {name}")
    if not found:
        raise InputError(
            "poses of a map",
            got="none",
            expected="at least one coordinate, or --poses FILE.csv",
            hint='write --x "-100 mm 100 mm 21"',
        )
    if asked.random is not None:
        ranges = {name: (low, high) for name, (low, high) in found.items()}
        return RandomPoses(asked.random, ranges, asked.seed)
    return Grid(
        {name: Axis(start, stop, _count(n, name)) for name, (start, stop, n) in found.items()}
    )


def _numbers(text: str, dimension: Dimension, words: Sequence[str], subject: str) -> list[float]:
    dimensions = [dimension, dimension, Dimension.NUMBER][: len(words)]
    return parse_quantities(text, dimensions, words, subject)


def _joint(robot: Robot, text: str) -> tuple[str, Dimension, str]:
    """Name of a joint, what it measures, and the rest of the text."""
    if not robot.is_serial:
        raise InputError("--joint", got=text, expected="--x and the like: joints pose serial arms")
    joints = joint_columns(robot.legs[0])
    # The longest name first: 'joint 1' before 'joint'.
    for name in sorted(joints.names, key=len, reverse=True):
        if text.strip().startswith(f"{name} "):
            unit = joints.unit_of(name)
            dimension = Dimension.LENGTH if unit == "m" else Dimension.ANGLE
            return name, dimension, text.strip().removeprefix(name)
    raise InputError(
        "--joint",
        got=text,
        expected=f"a joint ({', '.join(joints.names)}) and its range",
        hint=f'write --joint "{joints.names[0]} -1 1 21"' if joints.names else None,
    )


def _count(value: float, name: str) -> int:
    if value != int(value):
        raise InputError(f"count of {name}", got=value, expected="a whole number")
    return int(value)
