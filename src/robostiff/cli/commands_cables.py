"""The command ``cables``, and other commands for cable robots."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness, cable_response, cable_stiffness
from robostiff.cables import (
    ClosedFormTensions,
    GivenTensions,
    NearestTensions,
    TensionRule,
)
from robostiff.cli.answer_commands import WrittenTensions
from robostiff.cli.command import answered
from robostiff.cli.options import Answer, Model, Place
from robostiff.cli.robot_facts import head_facts, home_facts
from robostiff.cli.written_arguments import pose_from, wrench_from
from robostiff.errors import InputError
from robostiff.io.results.cables import (
    cable_response_data,
    cable_response_text,
    cable_stiffness_data,
    cable_stiffness_text,
)
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model.cable import CableRobot

_RULES = ("nearest", "closed-form")


def print_cables(model: Model, place: Place, written: WrittenTensions, answer: Answer) -> int:
    """Print tensions and stiffness at a pose, and the response to a load with locked winches."""
    robot, source = model.load(), model.source
    if not isinstance(robot, CableRobot):
        raise InputError(
            "robot of cables",
            got=source,
            expected="a robot with cables, such as cable-8",
            hint=f"write 'robostiff stiffness {source}' for a robot with legs",
        )
    wrench, balance = written.wrench, written.balance
    rule = _rule(robot, written.rule, written.level, written.tensions)
    pose = pose_from(robot, place)
    if wrench is not None:
        if balance is not None:
            raise InputError("--wrench and --balance", expected="one of them")
        result = cable_response(robot, pose, wrench_from(wrench, robot.space), tensions=rule)
        text, data = cable_response_text, cable_response_data
    else:
        held = None if balance is None else wrench_from(balance, robot.space, "--balance")
        result = cable_stiffness(robot, pose, held, tensions=rule)
        text, data = cable_stiffness_text, cable_stiffness_data
    return answered(result, answer, data, text)  # pyright: ignore[reportArgumentType]


def print_cable_stiffness(result: CableStiffness, answer: Answer) -> int:
    """Print K of a cable robot."""
    return answered(result, answer, cable_stiffness_data, cable_stiffness_text)


def cable_robot_facts(robot: CableRobot) -> dict[str, Any]:
    """Facts for ``robostiff check``."""
    home = cable_stiffness(robot)
    facts = head_facts(robot, "cable robot", [])
    return {**facts, "cables": robot.cable_names, "home": home_facts(home)}


def _rule(
    robot: CableRobot, name: str, level: float | None, given: str | None
) -> TensionRule | None:
    if name not in _RULES:
        raise InputError("--rule", got=name, expected=" or ".join(_RULES))
    if given is not None:
        if level is not None or name != _RULES[0]:
            other = "--rule" if level is None else "--level"
            raise InputError(f"--tensions and {other}", expected="one of them")
        count = len(robot.cables)
        values = parse_quantities(given, [Dimension.FORCE] * count, robot.cable_names, "--tensions")
        return GivenTensions(np.array(values))
    if name == "closed-form":
        return ClosedFormTensions() if level is None else ClosedFormTensions(level)
    return None if level is None else NearestTensions(level)
