"""Plots of one pose want one pose."""

from __future__ import annotations

from robostiff.analysis import RobotStiffness
from robostiff.errors import InputError


def single_stiffness(result: object, what: str) -> RobotStiffness:
    """The stiffness at one pose; what is none, or of several poses, is refused.

    Raises
    ------
    InputError
    """
    if not isinstance(result, RobotStiffness):
        raise InputError(
            f"stiffness for {what}",
            got=result,
            expected="what rs.stiffness(robot, pose) returns",
        )
    if result.batch_shape:
        raise InputError(
            f"stiffness for {what}",
            got=f"poses of shape {result.batch_shape}",
            expected="a single pose",
            hint="write result[0]",
        )
    return result
