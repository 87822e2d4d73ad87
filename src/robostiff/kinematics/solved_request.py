"""Poses that are found: by the coordinates of the actuators, or by tool tip and tool axis."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics.closure import NewtonTask
from robostiff.kinematics.closure.assembly import on_turn_of_home
from robostiff.kinematics.closure.assembly_mode import AssemblyMode
from robostiff.kinematics.closure.leg_equations import Followed, pose_of_end
from robostiff.kinematics.machine_pose import (
    ActuatorCoordinates,
    ToolPose,
    actuator_names,
    actuator_places,
)
from robostiff.kinematics.mobility import platform_mobility
from robostiff.kinematics.pose import PoseRequest, six_coordinates
from robostiff.kinematics.posture import Posture
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import (
    Actuated,
    Branch,
    Chain,
    Coupling,
    Joint,
    Leg,
    Locked,
    ParallelBlock,
    Passive,
    Rigid,
    Telescope,
    revolute,
)
from robostiff.model.chain import Element
from robostiff.spatial import Frame, as_floats, cross
from robostiff.spatial.batch import poses_side_by_side
from robostiff.spatial.rotation import vector_of_rotation

if TYPE_CHECKING:
    from robostiff.kinematics.posture_finder import PostureFinder

_ALL_OPEN = tuple(range(6))
_OPPOSITE = 1e-9  # of a half turn: the shortest way there has no direction


class SolvedRequest(PoseRequest, ABC):
    """Poses of which the coordinates are not given, but found together with the posture.

    ``coordinates`` holds the numbers that were given, one pose a row.
    """

    @abstractmethod
    def posture(self, finder: PostureFinder, near: Sequence[np.ndarray] | None) -> Posture:
        """The posture, nearest to coordinates of the legs where they are given."""


@dataclass(frozen=True)
class ActuatedRequest(SolvedRequest):
    """Postures by coordinates of the actuators (N, n): the forward kinematics of the robot."""

    def posture(self, finder: PostureFinder, near: Sequence[np.ndarray] | None) -> Posture:
        """Legs closed with the actuators held: in the assembly mode of home, or nearest."""
        robot, places = finder.robot, actuator_places(finder.robot)
        task = _ActuatedTask(
            tuple(_with_locked_drives(leg) for leg in robot.legs),
            tuple(robot.space.rows),
            finder.length,
            places,
        )
        homes = [solver.home for solver in finder.solvers]
        given = self.coordinates
        if near is None:
            found = task.at(finder.home_pose, homes, given)
        else:
            own = [np.tile(q, (len(given), 1)) for q in near]
            ends = np.cumsum([len(one) for one in places])[:-1]
            for q, where, drives in zip(own, places, np.split(given, ends, axis=1), strict=True):
                q[:, where] = drives
            start = pose_of_end(robot.legs[0], near[0])
            found = task.closed_near(np.tile(start, (len(given), 1)), own)
        coordinates = [
            on_turn_of_home(leg.chain, q, home)
            for leg, q, home in zip(task.legs, found.coordinates, near or homes, strict=True)
        ]
        R = turn_by_vector(found.pose[:, 3:])
        # A crank that may stand at any angle stands at the given one.
        return finder.placed(self.batch, found.pose, R, coordinates, found.elsewhere)


@dataclass(frozen=True)
class ToolRequest(SolvedRequest):
    """Postures by tip and unit axis of the tool (N, 6), turned about it as the legs demand."""

    # (3,): in the platform frame
    tool_axis: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    def posture(self, finder: PostureFinder, near: Sequence[np.ndarray] | None) -> Posture:
        """Legs closed together with a free joint about the tool axis."""
        robot, tip = finder.robot, self.coordinates[:, :3]
        wanted = _shortest_turn(finder, self.coordinates[:, 3:], self.tool_axis)
        goal = np.concatenate([tip, vector_of_rotation(wanted)], axis=-1)
        home = finder.home_pose
        at_home = home[:3] + turn_by_vector(home[3:]) @ robot.reference_point
        task = NewtonTask((_with_spindle(robot.legs, finder, self.tool_axis),), (), finder.length)
        if near is None:
            q = np.concatenate([*(solver.home for solver in finder.solvers), [0.0]])
            found = task.follow(np.concatenate([at_home, home[3:]]), [q], goal)
        else:
            q = np.concatenate([*near, [0.0]])
            found = task.closed_near(goal, [np.tile(q, (len(goal), 1))])
        (q,) = found.coordinates
        spin = -q[:, -1]
        R = np.einsum("nij,njk->nik", wanted, turn_about(self.tool_axis, spin))
        R = poses_side_by_side(R, 2)
        p = tip - np.einsum("nij,j->ni", R, robot.reference_point)
        sizes = [leg.chain.size for leg in robot.legs]
        homes = [solver.home for solver in finder.solvers]
        parts = np.split(q[:, :-1], np.cumsum(sizes)[:-1], axis=1)
        coordinates = [
            on_turn_of_home(leg.chain, poses_side_by_side(own, 1), home)
            for leg, own, home in zip(robot.legs, parts, near or homes, strict=True)
        ]
        pose = six_coordinates(R, p)
        open_ = finder.open_drives(pose, R, coordinates, near)
        return finder.placed(self.batch, pose, R, coordinates, found.elsewhere, undetermined=open_)


@dataclass(frozen=True)
class _ActuatedTask(NewtonTask):
    """Legs with locked drives, whose coordinates are prescribed; the pose follows."""

    # tuple of (d,): places of the drives in the coordinates of each leg
    drives: tuple[np.ndarray, ...] = ()

    def at(self, start: np.ndarray, q: list[np.ndarray], given: np.ndarray) -> Followed:
        """Postures at coordinates of the drives (N, d), in the mode of a closed posture."""
        still = np.tile(start[self._still], (len(given), 1))
        found = AssemblyMode(self, np.concatenate([start, *q])).at(np.hstack([still, given]))
        return Followed(*self._apart(found.x), found.kept, found.elsewhere)

    @cached_property
    def given(self) -> np.ndarray:
        """Places of the pose coordinates that are prescribed, and of the drives."""
        starts = np.cumsum([6, *(leg.chain.size for leg in self.legs)])[:-1]
        drives = (start + own for start, own in zip(starts, self.drives, strict=True))
        return np.concatenate([self._still, *drives])

    @property
    def _still(self) -> np.ndarray:
        return np.array([k for k in range(6) if k not in self.open], dtype=int)


def actuated_request(finder: PostureFinder, pose: ActuatorCoordinates) -> PoseRequest | np.ndarray:
    """Read coordinates of the actuators.

    Raises InputError when they do not fit, or do not determine the pose of the robot.
    """
    robot = finder.robot
    homes = [solver.home for solver in finder.solvers]
    places = actuator_places(robot)
    at_home = np.concatenate([q[own] for q, own in zip(homes, places, strict=True)])
    given = pose.numbers(robot, at_home)
    if robot.is_serial and len(places[0]) == robot.legs[0].chain.size:
        return given  # of all joints
    _check_determined(finder)
    batch = given.shape[:-1]
    rows = given.reshape(math.prod(batch), given.shape[-1])
    return ActuatedRequest(batch, rows, _ALL_OPEN)


def tool_request(finder: PostureFinder, pose: ToolPose) -> PoseRequest:
    """Read poses of the tool.

    Raises InputError when they do not fit.
    """
    robot = finder.robot
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
        return ToolRequest(batch, rows, _ALL_OPEN, tool_axis=own)
    spin = np.broadcast_to(spin, batch).reshape(-1)
    R = np.einsum("nij,njk->nik", _shortest_turn(finder, rows[:, 3:], own), turn_about(own, spin))
    p = rows[:, :3] - np.einsum("nij,j->ni", R, robot.reference_point)
    coordinates = six_coordinates(R, p)
    return PoseRequest(
        batch, poses_side_by_side(coordinates, 1), (), turned=poses_side_by_side(R, 2)
    )


def _shortest_turn(finder: PostureFinder, axis: np.ndarray, tool_axis: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) of the platform that turn the tool axis of home the shortest way."""
    R_home = turn_by_vector(finder.home_pose[3:])
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
def _check_determined(finder: PostureFinder) -> None:
    """Raise unless the platform stands still at home while all drives are held."""
    robot, homes = finder.robot, [solver.home for solver in finder.solvers]
    held = replace(robot, legs=tuple(map(_with_locked_drives, robot.legs)))
    free = platform_mobility(held, finder.home_pose, homes, finder.length).shape[1]
    if free:
        raise InputError(
            f"actuator coordinates of {robot.name!r}",
            got=", ".join(actuator_names(robot)),
            expected="drives that determine the pose: the platform keeps "
            f"{free} freedom{'s' if free > 1 else ''} at home while they are held",
            hint="give a pose of the platform",
        )


def _with_locked_drives(leg: Leg) -> Leg:
    return replace(leg, chain=_locked(leg.chain))


def _locked(chain: Chain) -> Chain:
    couplings = (
        replace(own, role=Locked(own.role.stiffness)) if isinstance(own.role, Actuated) else own
        for own in chain.couplings
    )
    return Chain(tuple(map(_locked_element, chain.elements)), tuple(couplings))


def _locked_element(element: Element) -> Element:
    if isinstance(element, ParallelBlock):
        branches = (replace(own, chain=_locked(own.chain)) for own in element.branches)
        return replace(element, branches=tuple(branches))
    if isinstance(element, Joint | Telescope) and isinstance(element.role, Actuated):
        return replace(element, role=Locked(element.role.stiffness))
    return element


def _with_spindle(legs: Sequence[Leg], finder: PostureFinder, tool_axis: np.ndarray) -> Leg:
    """All legs in one, which ends with a free joint about the tool axis at the reference point."""
    block: tuple = ()
    couplings: tuple[Coupling, ...] = ()
    spindle = revolute(tool_axis, Passive(), name="spindle")
    to_tip = Rigid(Frame(np.eye(3), finder.robot.reference_point), "to the tip")
    if len(legs) > 1:
        branches = (Branch(leg.name, leg.base, leg.chain, leg.attachment) for leg in legs)
        base, block = Frame.identity(), (ParallelBlock(tuple(branches), "legs"),)
    else:
        (leg,) = legs
        base, block = leg.base, (*leg.chain.elements, Rigid(leg.attachment.inverse, "end"))
        couplings = leg.chain.couplings
    return Leg("tool", base, Chain((*block, to_tip, spindle), couplings), Frame.identity())
