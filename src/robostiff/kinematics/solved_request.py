"""Poses that are found: by the coordinates of the actuators, or by tool tip and tool axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.closure import Loops, closed_near, follow, loops_of_legs
from robostiff.kinematics.closure.assembly import on_turn_of_home
from robostiff.kinematics.closure.assembly_mode import Followed
from robostiff.kinematics.closure.loops import platform_mobility
from robostiff.kinematics.machine_pose import (
    ActuatorCoordinates,
    ToolPose,
    actuator_names,
    actuator_places,
)
from robostiff.kinematics.pose import (
    FoundPoses,
    NearLegs,
    PoseRequest,
    pose_of_end,
    six_coordinates,
)
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import (
    Branch,
    Chain,
    Coupling,
    Leg,
    ParallelBlock,
    Passive,
    Rigid,
    Robot,
    revolute,
)
from robostiff.spatial import Frame, as_floats, cross
from robostiff.spatial.batch import poses_side_by_side
from robostiff.spatial.rotation import vector_of_rotation

_ALL_OPEN = tuple(range(6))
_OPPOSITE = 1e-9  # of a half turn: the shortest way there has no direction


@dataclass(frozen=True)
class HomePosture:
    """A robot in numbers at home, from where its postures are followed."""

    robot: Robot
    pose: np.ndarray  # (6,): pose coordinates
    legs: tuple[np.ndarray, ...]  # coordinates that close each leg
    length: float  # characteristic length [m]


def found_from(
    loops: Loops, home: Sequence[np.ndarray], near: NearLegs, given: np.ndarray
) -> Followed:
    """Postures at prescribed coordinates (N, g): followed from home, or closed near another one.

    Home and the other one are pose coordinates (6,), then coordinates of each leg.
    """
    if near is None:
        return follow(loops, np.concatenate(home), given)
    # It need not close, so that no path leads from it.
    x = np.tile(np.concatenate(near), (len(given), 1))
    x[:, loops.given] = given
    return closed_near(loops, x)


def _found_by_drives(home: HomePosture, numbers: np.ndarray, near: NearLegs) -> FoundPoses:
    """Postures by coordinates (N, n) of the actuators, which are held: forward kinematics."""
    robot, rows = home.robot, home.robot.space.rows
    loops = loops_of_legs(robot.legs, rows, home.length, actuator_places(robot))
    start = None if near is None else [pose_of_end(robot.legs[0], near[0]), *near]
    still = np.tile(np.delete(home.pose, rows), (len(numbers), 1))
    given = np.concatenate([still, numbers], axis=-1)
    found = found_from(loops, [home.pose, *home.legs], start, given)
    q = _on_turns(home, found.coordinates, near)
    return found.pose, turn_by_vector(found.pose[:, 3:]), q, found.elsewhere


def _found_by_tool(
    home: HomePosture, axis: tuple[float, ...], numbers: np.ndarray, near: NearLegs
) -> FoundPoses:
    """Postures by tip and unit axis of the tool (N, 6), turned about it as the legs demand.

    Legs are closed together with a free joint about the tool axis, (3,) in the platform frame.
    """
    robot, tip, own = home.robot, numbers[:, :3], np.array(axis)
    wanted = _shortest_turn(home.pose, numbers[:, 3:], own)
    goal = np.concatenate([tip, vector_of_rotation(wanted)], axis=-1)
    tip_at_home = home.pose[:3] + turn_by_vector(home.pose[3:]) @ robot.reference_point
    start = np.concatenate([tip_at_home, home.pose[3:]])
    loops = loops_of_legs((_with_spindle(robot, own),), (), home.length)
    spun = np.zeros(1)
    aside = None if near is None else [start, *near, spun]
    found = found_from(loops, [start, *home.legs, spun], aside, goal)
    (q,) = found.coordinates
    R = np.einsum("nij,njk->nik", wanted, turn_about(own, -q[:, -1]))
    R = poses_side_by_side(R, 2)
    p = tip - np.einsum("nij,j->ni", R, robot.reference_point)
    parts = np.split(q[:, :-1], np.cumsum([x.size for x in home.legs])[:-1], axis=1)
    legs = _on_turns(home, [poses_side_by_side(x, 1) for x in parts], near)
    return six_coordinates(R, p), R, legs, found.elsewhere


def _on_turns(home: HomePosture, each: Sequence[np.ndarray], near: NearLegs) -> list[np.ndarray]:
    legs = zip(home.robot.legs, each, near or home.legs, strict=True)
    return [on_turn_of_home(leg.chain, q, own) for leg, q, own in legs]


def actuated_request(home: HomePosture, pose: ActuatorCoordinates) -> PoseRequest | np.ndarray:
    """Read coordinates of the actuators.

    Raises InputError when they do not fit, or do not determine the pose of the robot.
    """
    robot, places = home.robot, actuator_places(home.robot)
    at_home = np.concatenate([q[own] for q, own in zip(home.legs, places, strict=True)])
    given = pose.numbers(robot, at_home)
    if robot.is_serial and len(places[0]) == robot.legs[0].chain.size:
        return given  # of all joints
    _check_determined(home)
    batch = given.shape[:-1]
    rows = given.reshape(math.prod(batch), given.shape[-1])
    find = partial(_found_by_drives, home)
    return PoseRequest(batch, rows, _ALL_OPEN, find=find, by_drives=True)


def tool_request(home: HomePosture, pose: ToolPose) -> PoseRequest:
    """Read poses of the tool.

    Raises InputError when they do not fit.
    """
    robot = home.robot
    tip, axis, own = pose.numbers(robot)
    rows = np.concatenate([tip, axis], axis=-1)
    if pose.spin is not None:
        subject = f"tool pose of {robot.name!r}, spin"
        spin = as_floats(subject, pose.spin, "finite angles [rad]", "rad")
        batch = np.broadcast_shapes(spin.shape, rows.shape[:-1])
    else:
        spin, batch = np.zeros(()), rows.shape[:-1]
    rows = np.broadcast_to(rows, (*batch, 6)).reshape(math.prod(batch), 6)
    freedoms = len(robot.coordinates)
    if robot.is_posed_by_joints:
        freedoms = np.count_nonzero(robot.legs[0].chain.free)
    if pose.spin is None and freedoms < len(_ALL_OPEN):
        find = partial(_found_by_tool, home, tuple(own.tolist()))
        return PoseRequest(batch, rows, _ALL_OPEN, find=find)
    spin = np.broadcast_to(spin, batch).reshape(-1)
    wanted = _shortest_turn(home.pose, rows[:, 3:], own)
    R = np.einsum("nij,njk->nik", wanted, turn_about(own, spin))
    p = rows[:, :3] - np.einsum("nij,j->ni", R, robot.reference_point)
    coordinates = six_coordinates(R, p)
    return PoseRequest(
        batch, poses_side_by_side(coordinates, 1), (), turned=poses_side_by_side(R, 2)
    )


def _shortest_turn(home: np.ndarray, axis: np.ndarray, tool_axis: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) of the platform that turn the tool axis of home the shortest way."""
    R_home = turn_by_vector(home[3:])
    start = R_home @ tool_axis
    across = cross(np.broadcast_to(start, axis.shape), axis)
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    # The opposite direction is as near on any way: it is turned about one axis of the platform.
    any_way = np.eye(3)[np.argmin(np.abs(start))]
    any_way = any_way - start * (start @ any_way)
    unit = np.where(size > _OPPOSITE, across / np.where(size > 0, size, 1.0), any_way)
    unit = unit / np.linalg.norm(unit, axis=-1, keepdims=True)
    angle = np.arctan2(size[:, 0], axis @ start)
    return np.einsum("nij,jk->nik", turn_by_vector(unit * angle[:, None]), R_home)


@kept
def _check_determined(home: HomePosture) -> None:
    """Raise unless the platform stands still at home while all drives are held."""
    robot = home.robot
    held = actuator_places(robot)
    free = platform_mobility(robot, home.pose, home.legs, home.length, held).shape[1]
    if free:
        raise InputError(
            f"actuator coordinates of {robot.name!r}",
            got=", ".join(actuator_names(robot)),
            expected="drives that determine the pose: the platform keeps "
            f"{free} freedom{'s' if free > 1 else ''} at home while they are held",
            hint="give a pose of the platform",
        )


def _with_spindle(robot: Robot, tool_axis: np.ndarray) -> Leg:
    """All legs in one, which ends with a free joint about the tool axis at the reference point."""
    block: tuple = ()
    couplings: tuple[Coupling, ...] = ()
    spindle = revolute(tool_axis, Passive(), name="spindle")
    to_tip = Rigid(Frame(np.eye(3), robot.reference_point), "to the tip")
    leg, *others = robot.legs
    if others:
        branches = (Branch(leg.name, leg.base, leg.chain, leg.attachment) for leg in robot.legs)
        base, block = Frame.identity(), (ParallelBlock(tuple(branches), "legs"),)
    else:
        base, block = leg.base, (*leg.chain.elements, Rigid(leg.attachment.inverse, "end"))
        couplings = leg.chain.couplings
    return Leg("tool", base, Chain((*block, to_tip, spindle), couplings), Frame.identity())
