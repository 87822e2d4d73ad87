"""Machines of any kind placed at one pose, and drawn around something else."""

from __future__ import annotations

from typing import Any, cast

from robostiff.analysis import CableStiffness, stiffness
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Near
from robostiff.linkage import Linkage
from robostiff.model import Robot, Snapshot
from robostiff.model.cable import CableRobot
from robostiff.network import Network
from robostiff.plot.geometry.ellipsoid import AnyStiffness
from robostiff.plot.outline import outline_of
from robostiff.plot.sketch import Sketch

Posed = Snapshot | Network | CableStiffness
Machine = Robot | Snapshot | Network | Linkage | CableRobot | CableStiffness


def placed(machine: Machine, pose: Any = None, near: Near = None) -> Posed:
    """A machine at a single pose, in the posture nearest to some joint coordinates.

    Raises
    ------
    InputError
        When it is no machine, or the pose does not fit it.
    NoAnswerError
        When the pose is out of reach.
    """
    if isinstance(machine, CableStiffness):
        return machine
    if not isinstance(machine, Machine):
        raise InputError(
            "robot of a plot",
            got=machine,
            expected="a Robot, Snapshot, Network, Linkage or CableRobot",
            hint='write rs.load("hexapod")',
        )
    result: Any = stiffness(cast("Robot", machine), pose, near=near)
    if result.batch_shape:
        raise InputError(
            "pose of a plot", got=f"poses of shape {result.batch_shape}", expected="a single pose"
        )
    if isinstance(result, CableStiffness):
        return result
    if Status.UNREACHABLE in result.status:
        raise NoAnswerError(f"no picture of {machine.name!r}: {'; '.join(result.advice)}")
    return result.placed()


def surroundings(machine: Machine | None, result: AnyStiffness) -> Sketch | None:
    """The robot around a result, at its pose, in the unit of the axes; of cables always.

    Raises InputError when it is none that can be drawn at the pose of the result.
    """
    if machine is None and not isinstance(result, CableStiffness):
        return None
    if machine is None or machine.name == result.name:
        posed = result if isinstance(result, CableStiffness) else result.placed()
    else:
        posed = placed(machine, result.pose)
    return Sketch(outline=outline_of(posed)).in_unit()


def single_stiffness(result: object, what: str) -> AnyStiffness:
    """The stiffness at one pose; other values and several poses are an `InputError`."""
    if not isinstance(result, AnyStiffness):
        raise InputError(
            f"stiffness for {what}", got=result, expected="a result of rs.stiffness(robot, pose)"
        )
    if result.batch_shape:
        raise InputError(
            f"stiffness for {what}",
            got=f"poses of shape {result.batch_shape}",
            expected="a single pose",
            hint="write result[0]",
        )
    return result
