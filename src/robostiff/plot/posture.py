"""The robot to be drawn, at one pose that it can reach, and the robot around something else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness, Stiffness, cable_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near, Pose, find_posture
from robostiff.kinematics.pose import check_is_not_posed
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.geometry.ellipsoid import AnyStiffness
from robostiff.plot.outline import outline_of
from robostiff.plot.picture import Item
from robostiff.plot.sketch import Sketch, unit_of

Around = Robot | Snapshot | Network | CableRobot | CableStiffness


def snapshot_at(robot: Robot | Snapshot, pose: Pose, near: Near = None) -> Snapshot:
    """A robot at a single pose, in the posture nearest to some joint coordinates."""
    if isinstance(robot, Snapshot):
        return _single(robot, pose)
    if not isinstance(robot, Robot):
        raise InputError(
            "robot of a plot",
            got=robot,
            expected="a Robot or a Snapshot",
            hint='write rs.load("hexapod")',
        )
    posture = find_posture(robot, pose, near=near)
    if posture.batch:
        raise InputError(
            "pose of a plot", got=f"poses of shape {posture.batch}", expected="a single pose"
        )
    if not posture.reached[0]:
        raise NoAnswerError(f"no picture of {robot.name!r}: {'; '.join(posture.complaints)}")
    return posture.snapshot.one(0)


def _single(snapshot: Snapshot, pose: Pose) -> Snapshot:
    check_is_not_posed(snapshot, pose)
    batch = snapshot.reference_point.shape[:-1]
    if batch == (1,):
        return snapshot.one(0)
    if batch:
        raise InputError(
            f"snapshot {snapshot.name!r}",
            got=f"poses of shape {batch}",
            expected="a single pose",
            hint="write snapshot.one(0)",
        )
    return snapshot


@dataclass(frozen=True)
class Surroundings:
    """A robot of any kind in the background of something else."""

    size: float  # of the robot [m]
    factor: float  # from metres to the unit of the axes
    unit: str  # of the axes
    is_flat: bool
    items: tuple[Item, ...]


def surroundings(robot: Around | None, result: AnyStiffness) -> Surroundings | None:
    """The robot around a result, at its pose; a cable robot is always drawn.

    Raises InputError when `robot` is none that can be drawn at the pose of the result.
    """
    if isinstance(robot, CableRobot):
        robot = cable_stiffness(robot, result.pose)
    posed = robot if isinstance(robot, CableStiffness) else result
    if not isinstance(posed, CableStiffness):
        if robot is None:
            return None
        posed = _placed(robot, posed)
    sketch = Sketch(outline=outline_of(posed)).in_unit()
    unit, items = unit_of(sketch.size)[1], tuple(sketch.backdrop())
    return Surroundings(sketch.size, sketch.factor, unit, sketch.outline.is_level, items)


def _placed(robot: Any, result: Stiffness) -> Snapshot | Network:
    if isinstance(robot, Network):
        return robot
    if isinstance(robot, Snapshot):
        return snapshot_at(robot, None)
    if isinstance(result, Stiffness) and robot.name == result.name:
        return result.snapshot()  # in the posture that the result is of
    return snapshot_at(robot, _pose(result))


def _pose(result: AnyStiffness) -> np.ndarray:
    if result.pose is None:
        raise InputError(
            "robot around a result",
            got=f"the stiffness of {result.name!r}, which has no pose",
            expected="the snapshot or the network itself",
            hint="write within=snapshot",
        )
    return result.pose


def single_stiffness(result: object, what: str) -> AnyStiffness:
    """The stiffness at one pose; other values and several poses are an `InputError`."""
    if not isinstance(result, AnyStiffness):
        raise InputError(
            f"stiffness for {what}",
            got=result,
            expected="a result of rs.stiffness(robot, pose)",
        )
    if result.batch_shape:
        raise InputError(
            f"stiffness for {what}",
            got=f"poses of shape {result.batch_shape}",
            expected="a single pose",
            hint="write result[0]",
        )
    return result
