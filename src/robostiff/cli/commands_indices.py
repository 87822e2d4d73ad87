"""The command ``indices``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.analysis import stiffness
from robostiff.analysis.indices import indices
from robostiff.cli.failure import BAD_STATUS
from robostiff.cli.output import print_data, say
from robostiff.cli.written_arguments import (
    PoseArguments,
    near_from,
    parameters_from,
    point_from,
    pose_from,
)
from robostiff.errors import InputError
from robostiff.io.results.indices import indices_data, indices_text
from robostiff.io.results.text import stiffness_text
from robostiff.io.units import Dimension, parse_quantities
from robostiff.model import Robot, Snapshot
from robostiff.network import Network
from robostiff.robots import load


def print_indices(
    source: str, place: PoseArguments, length: str | None, settings: Sequence[str], as_json: bool
) -> int:
    """Print the stiffness indices at a pose; 1 for a bad status."""
    robot = load(source, parameters_from(settings))
    if not isinstance(robot, Robot | Snapshot | Network):
        raise InputError(
            f"indices of {robot.name!r}",
            got="a cable robot",
            expected="a robot with legs: the stiffness of cables depends on their tensions",
        )
    L = None
    if length is not None:
        L = parse_quantities(length, [Dimension.LENGTH], ["length"], "--length")[0]
    pose, near = pose_from(robot, place), near_from(robot, place)
    result = stiffness(robot, pose, at=point_from(place), near=near)
    found = indices(result, length=L) if np.all(result.answered) else None
    if as_json:
        print_data(indices_data(result, found))
    else:
        say(stiffness_text(result) if found is None else indices_text(found))
    return BAD_STATUS if result.status.is_bad else 0
