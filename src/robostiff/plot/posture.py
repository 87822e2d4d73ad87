"""The robot to be drawn: one snapshot at one pose that it can reach."""

from __future__ import annotations

from robostiff.analysis import RobotStiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Pose, find_posture
from robostiff.model import Robot, Snapshot


def snapshot_at(robot: Robot | Snapshot, pose: Pose) -> Snapshot:
    """A robot at a single pose.

    Raises
    ------
    InputError
        When `robot` has no legs to be drawn, or there are several poses.
    NoAnswerError
        When the pose is out of reach.
    """
    if isinstance(robot, Snapshot):
        return _single(robot, pose)
    if not isinstance(robot, Robot):
        raise InputError(
            "robot of a plot",
            got=robot,
            expected="a Robot or a Snapshot",
            hint='write rs.load("hexapod")',
        )
    posture = find_posture(robot, pose)
    if posture.batch:
        raise InputError(
            "pose of a plot", got=f"poses of shape {posture.batch}", expected="a single pose"
        )
    if not posture.reached[0]:
        raise NoAnswerError(f"no picture of {robot.name!r}: {'; '.join(posture.complaints)}")
    return posture.snapshot.one(0)


def _single(snapshot: Snapshot, pose: Pose) -> Snapshot:
    if pose is not None:
        raise InputError(
            f"pose of snapshot {snapshot.name!r}",
            got=pose,
            expected="none: a snapshot is frozen at its own pose",
        )
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


def single_stiffness(result: object, what: str) -> RobotStiffness:
    """The stiffness at one pose; other values and several poses are refused.

    Raises
    ------
    InputError
    """
    if not isinstance(result, RobotStiffness):
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
