"""Generic postures of a robot near home, at which records are sampled."""

from __future__ import annotations

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Posture, PostureFinder
from robostiff.model import Robot

COUNT = 5
_SEED = 20110
_SHRINKS = 6


def sample_postures(robot: Robot, finder: PostureFinder, seed: int | None = None) -> Posture:
    """A few postures near home in general position, one a row, that all legs reach.

    Pose coordinates that the robot is free to choose are drawn at random; the others follow from
    the legs. For a serial arm posed by its joints, joint coordinates are drawn. Another seed gives
    others than those of the records.

    Raises
    ------
    InputError
        When no neighbourhood of home is reached.
    """
    random = np.random.default_rng(_SEED if seed is None else seed)
    spread = 0.1
    for _ in range(_SHRINKS):
        posture = _drawn(robot, finder, random, spread)
        reached = np.flatnonzero(posture.reached)
        if reached.size >= COUNT:
            return posture_rows(finder, posture, reached[:COUNT])
        spread *= 0.2
    raise InputError(
        f"home pose of {robot.name!r}",
        got="poses around it that the legs do not reach",
        expected="a home pose with room around it",
        hint="free coordinates that the legs fix belong out of `coordinates`",
    )


def posture_rows(finder: PostureFinder, posture: Posture, rows: np.ndarray) -> Posture:
    """Some rows of a posture."""
    if finder.robot.is_posed_by_joints:
        return finder.at_joints(posture.coordinates[0][rows])
    return finder.find(posture.pose[rows])


def _drawn(
    robot: Robot, finder: PostureFinder, random: np.random.Generator, spread: float
) -> Posture:
    if robot.is_posed_by_joints:
        home = robot.legs[0].chain.home
        moving = robot.legs[0].chain.free
        shifts = spread * random.uniform(-3, 3, (3 * COUNT, home.size)) * moving
        return finder.find(JointCoordinates(home + shifts))
    chosen = robot.coordinate_places
    scale = np.where(np.arange(6) < 3, finder.length, 2.0)[chosen]
    shifts = spread * scale * random.uniform(-1, 1, (3 * COUNT, len(chosen)))
    return finder.find(finder.home_pose[chosen] + shifts)
