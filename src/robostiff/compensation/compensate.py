"""Commands whose loaded pose is the wanted one."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robostiff.compiled import Backend
from robostiff.elastostatics.status import Status, StatusOfPoses
from robostiff.errors import InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.kinematics import JointCoordinates, Pose, Posture, actuator_names, posture_finder
from robostiff.kinematics.closure.leg_forms import beyond_limits
from robostiff.kinematics.machine_pose import actuator_places
from robostiff.kinematics.pose import Near
from robostiff.kinematics.turn import pose_after, turn_after, turn_by_vector, turned_point
from robostiff.markup import InNotebooks, number
from robostiff.model import Actuated, Robot
from robostiff.spatial import as_floats, check_order, check_whole
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.loading.given_loads import Gravity, Loads

if TYPE_CHECKING:
    from robostiff.statics import CompiledLoading

_BOWING = Bowing()
# Points from which on machine code is worth its compilation.
_MANY = 1_000
# Of the size of the robot: closer than this no step is taken.
_THERE = 1e-14
# By which commands are moved to find the rates of poses [m, rad].
_STEP = 1e-5
# A correction changes by so many times the median between neighbours: a jump. Below, in metres and
# radians, nothing is one.
_JUMP, _NO_JUMP = 10.0, 1e-8
# Along the tool more than this part of a direction of travel leaves no direction across it.
_ALONG = 1.0 - 1e-9


class Axes(Enum):
    """Axes in which the wrench of a point of a path is given; it is about the reference point.

    ``WORLD``; ``TOOL``, those of the wanted platform; ``PATH``, x along the direction of travel and
    z as near to that of the wanted platform as can be.
    """

    WORLD = "world"
    TOOL = "tool"
    PATH = "path"


@frozen
class Mirror:
    """The wanted pose less the deviation there: positions by difference, R R_loaded^T R."""


@frozen
class Exact:
    """The command is corrected by what is missing until nothing is.

    Attributes
    ----------
    steps : int
        At most; each leaves about the deviation over the size of the robot.
    """

    steps: int = 8

    def __post_init__(self) -> None:
        check_whole("steps of Exact", self.steps)


@frozen
class Compensation(StatusOfPoses, InNotebooks):
    """Commands for the points of a path, and what is left of the deviation.

    Attributes
    ----------
    robot : Robot
    target : (N, 6) array
        Wanted poses of the platform [m, rad].
    commanded : (N, 6) array
        Poses without load that arrive there; not a number without an answer.
    coordinates : (N, n) array
        The same as coordinates of the robot: free pose coordinates, or joints of an arm.
    drives : (N, d) array
        Coordinates of the drives there, in the order of `drive_names` [m, rad].
    deviation : (N, 6) array
        What is missing without correction: shift of the reference point and rotation vector
        [m, rad]; not a number where a target is out of reach.
    residual : (N, 6) array
        What is missing with it.
    status_codes : (N,) array of uint16
    jumps : tuple of int
        Points, from 0, before which the correction jumps.
    """

    robot: Robot
    target: np.ndarray
    commanded: np.ndarray
    coordinates: np.ndarray
    drives: np.ndarray
    deviation: np.ndarray
    residual: np.ndarray
    status_codes: np.ndarray
    jumps: tuple[int, ...]

    @property
    def drive_names(self) -> tuple[str, ...]:
        """Names of the drives."""
        return actuator_names(self.robot)

    def __repr__(self) -> str:
        if not np.isfinite(self.commanded).any():
            return f"<Compensation of {len(self.target)} points, status {self.status}: no command>"
        before, after = (
            1e6 * np.nanmax(np.linalg.norm(each[:, :3], axis=1))
            for each in (self.deviation, self.residual)
        )
        jumps = f", {len(self.jumps)} jumps" if self.jumps else ""
        return (
            f"<Compensation of {len(self.target)} points: at most {number(before)} um before, "
            f"{number(after, 3)} um after{jumps}, status {self.status}>"
        )


def compensate(
    robot: Robot,
    path: Pose,
    wrenches: ArrayLike,
    method: Mirror | Exact = Exact(),
    *,
    axes: Axes = Axes.WORLD,
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, float] | None = None,
    beams: Beams = _BOWING,
    near: Near = None,
) -> Compensation:
    """Commands by which a robot under the forces of a process follows a path.

    With the loaded pose L(u) of a command u, L(u) = target is solved: `Exact` adds what is missing
    until nothing is, `Mirror` takes the deviation at the target from it once. Drives keep their
    commanded coordinates. The wrench belongs to the target, not to the command.

    Parameters
    ----------
    robot : Robot
    path : (N, n) array, JointCoordinates, ActuatorCoordinates or ToolPose
        Wanted poses, as `find_posture` takes them.
    wrenches : (r,) or (N, r) array
        On the platform about its reference point [N, N m].
    method : Mirror or Exact
    axes : Axes
        In which the wrenches are given.
    loads, gravity, preload, beams
        As for `equilibrium`.
    near : joint coordinates, optional
        Which posture is meant where an arm that joints pose has a path of poses, as for
        `find_posture`.

    Returns
    -------
    Compensation
        Points beyond limits, out of reach or without equilibrium have a status, and the others
        their commands. Of a robot with less than six free coordinates these are corrected, and
        `residual` is what remains of the others.

    Raises
    ------
    InputError
        When the robot has no drives, or laws of force, the wrenches do not fit, or `near` is given
        for a robot that is posed by its platform, which keeps the posture of home.
    NoAnswerError
        When the platform has free motions at every pose, or a leg is rigid in some direction.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("hexapod")
    >>> path = np.zeros((5, 6)) + [0, 0, 0.9, 0, 0, 0]
    >>> path[:, 0] = np.linspace(-0.1, 0.1, 5)
    >>> found = rs.compensate(robot, path, [500, 0, -2000, 0, 0, 0])
    >>> bool(np.abs(found.deviation).max() > 1e-6), bool(np.abs(found.residual).max() < 1e-12)
    (True, True)
    """
    from robostiff.statics.kernels.compile import kept_loading

    if not isinstance(robot, Robot):
        subject, hint = "robot to compensate", 'write compensate(load("hexapod"), path, wrenches)'
        raise InputError(subject, got=type(robot).__name__, expected="a Robot", hint=hint)
    if not actuator_names(robot):
        subject, got = f"robot to compensate, {robot.name!r}", Words("a robot without drives")
        raise InputError(subject, got=got, expected="drives, which take the commands")
    if near is not None and not robot.is_posed_by_joints:
        subject, expected = f"near of {robot.name!r}", "none: commands keep the posture of home"
        raise InputError(subject, got=near, expected=expected)
    finder = posture_finder(robot)
    request = finder.request(path)
    wanted, pose = None, request.coordinates
    if robot.is_posed_by_joints or not request.is_whole or len(robot.coordinates) < 6:
        wanted = finder.at(request, near)
        pose = wanted.pose
    size = robot.space.size
    check_order("wrenches", wrenches, robot.space.wrench_order)
    expected = f"{size} numbers, or that of each point"
    F = as_floats("wrenches", wrenches, expected, robot.space.wrench_units)
    if F.shape not in {(size,), (len(pose), size)}:
        expected = f"({size},) or ({len(pose)}, {size}), one for each point of the path"
        raise InputError("wrenches", got=Words(f"shape {F.shape}"), expected=expected)
    F = _in_world(np.broadcast_to(F, (len(pose), size)), pose, axes, robot)
    backend = Backend.BEST if len(pose) >= _MANY else Backend.ARRAYS
    loaded = kept_loading(robot, gravity, loads, preload, beams=beams, backend=backend)
    return _Commands(robot, loaded, pose, wanted, F).correct(method)


def _in_world(F: np.ndarray, pose: np.ndarray, axes: Axes, robot: Robot) -> np.ndarray:
    """Wrenches (N, r) in world axes, at wanted poses (N, 6)."""
    if axes is Axes.WORLD:
        return F
    R = turn_by_vector(pose[:, 3:])
    if axes is Axes.PATH:
        R = _along_path(pose[:, :3], R[:, :, 2])
    turned = np.einsum("nij,nkj->nki", R, robot.space.spatial(F).reshape(-1, 2, 3))
    return turned.reshape(-1, 6)[:, list(robot.space.rows)]


def _along_path(points: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Axes (N, 3, 3): x along the direction of travel, z as near to that given as can be."""
    if len(points) < 2:
        expected = "two points or more, for a direction"
        raise InputError("axes of the path", got=Words("one point"), expected=expected)
    along = np.gradient(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    x = along / np.where(length > 0, length, 1.0)[:, None]
    for point in np.flatnonzero((length == 0) | (np.abs(np.sum(x * z, axis=1)) > _ALONG))[:1]:
        raise InputError(
            f"axes of the path at point {point + 1}",
            got=Words("no direction of travel across the tool"),
            expected="points that differ across the tool axis",
            hint="give the wrenches in Axes.WORLD or Axes.TOOL",
        )
    y = np.cross(z, x)
    y = y / np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


@frozen
class _Commands:
    """Commands of a robot for wanted postures under wrenches."""

    robot: Robot
    loaded: CompiledLoading
    pose: np.ndarray  # (N, 6): wanted
    wanted: Posture | None  # where joints follow, or coordinates are left open
    F: np.ndarray  # (N, r), world axes

    @property
    def followed(self) -> list[int]:
        """What can be corrected: all that an arm misses, else the free coordinates."""
        return list(range(6)) if self.robot.is_posed_by_joints else self.robot.coordinate_places

    @property
    def point(self) -> np.ndarray:
        """The reference point in the platform frame (3,), whose shifts are meant [m]."""
        return self.robot.in_floats.reference_point

    @property
    def start(self) -> np.ndarray:
        """Commands (N, n) whose poses without load are those wanted."""
        if self.robot.is_posed_by_joints and self.wanted is not None:
            return self.wanted.coordinates[0]
        return self.pose[:, self.robot.coordinate_places]

    def correct(self, method: Mirror | Exact) -> Compensation:
        """The result of a method."""
        command, finder = self.start.copy(), posture_finder(self.robot)
        first, codes = self._missing(command)
        residual = first
        if isinstance(method, Mirror):
            command = self._mirrored(command, first)
            residual, codes = self._missing(command)
        else:
            # Each point by itself; what it missed before is 0 where no step lessens it.
            there, before = _THERE * finder.length, np.full(len(command), np.inf)
            for _ in range(method.steps):
                moved = self._moved(command, residual)
                command = np.where((before > there)[:, None], moved, command)
                residual, codes = self._missing(command)
                largest = np.abs(residual[:, self.followed]).max(axis=1, initial=0.0)
                before = np.where(largest < before, largest, 0.0)
                if np.all(before <= there):
                    break
        request = finder.request(self._request(command))
        if request.is_whole:
            commanded, every = request.coordinates.copy(), finder.leg_coordinates(request)
        else:
            posture = finder.at(request)
            commanded, every = posture.pose.copy(), posture.coordinates
        codes, residual = codes.copy(), residual.copy()
        for leg, q in zip(self.robot.legs, every, strict=True):
            codes[beyond_limits(leg.chain, q)] |= np.uint16(Status.BEYOND_LIMITS)
        each = zip(every, actuator_places(self.robot), strict=True)
        drives = np.concatenate([q[:, places] for q, places in each], axis=1)
        lost = ~np.isfinite(residual).all(axis=1)
        for values in (commanded, drives, command, residual):
            values[lost] = np.nan
        corrections = _between(self.pose, commanded, self.point)
        steps = np.abs(np.diff(corrections, axis=0)).max(axis=1, initial=0.0)
        known = steps[np.isfinite(steps)]
        steps, usual = np.nan_to_num(steps), float(np.median(known)) if len(known) else 0.0
        return Compensation(
            robot=self.robot,
            target=self.pose,
            commanded=commanded,
            coordinates=command,
            drives=drives,
            deviation=first,
            residual=residual,
            status_codes=codes,
            jumps=tuple((np.flatnonzero(steps > max(_JUMP * usual, _NO_JUMP)) + 1).tolist()),
        )

    def _request(self, command: np.ndarray) -> np.ndarray | JointCoordinates:
        """A command as questions take it."""
        return JointCoordinates(command) if self.robot.is_posed_by_joints else command

    def _pose(self, command: np.ndarray) -> np.ndarray:
        """Poses (N, 6) without load."""
        finder = posture_finder(self.robot)
        request = finder.request(self._request(command))
        return request.coordinates if request.is_whole else finder.at(request).pose

    def _missing(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is missing of the targets under load (N, 6), and status codes (N,)."""
        answer, pose = self.loaded.evaluate(self._request(command), self.F), self._pose(command)
        moved = self.robot.space.spatial(answer.displacement)
        missing = _between(pose_after(pose, moved, self.point), self.pose, self.point)
        codes = answer.status_codes
        if self.wanted is not None:  # a robot stops nearest to what is too far
            missing[~self.wanted.reached] = np.nan
            codes[~self.wanted.reached] = Status.UNREACHABLE
        return missing, codes

    def _moved(self, command: np.ndarray, missing: np.ndarray) -> np.ndarray:
        """Commands whose unloaded poses are further by a shift and a rotation (N, 6)."""
        known = np.asarray(np.isfinite(missing).all(axis=1))
        step = np.where(known[:, None], missing, 0.0)
        if not self.robot.is_posed_by_joints and command.shape[1] == 6:
            moved = pose_after(self._pose(command), step, self.point)
        else:
            moved = command + np.einsum("nij,nj->ni", self._inverse_rates, step[:, self.followed])
        return np.where(known[:, None], moved, command)

    def _mirrored(self, start: np.ndarray, missing: np.ndarray) -> np.ndarray:
        """Commands at the target less its deviation, rotations by R R_loaded^T R."""
        aim = pose_after(self.pose, missing, self.point)
        command = self._moved(start, missing)
        for _ in range(
            Exact.steps if self.robot.is_posed_by_joints else 0
        ):  # joints that lead there
            step = _between(self._pose(command), aim, self.point)
            command = self._moved(command, step)
            largest = np.nanmax(np.abs(step), initial=0.0)
            if not largest > _THERE * posture_finder(self.robot).length:
                break
        return command

    @cached_property
    def _inverse_rates(self) -> np.ndarray:
        """Rates of commands with what is followed of the platform (N, n, m), at the targets.

        Raises NoAnswerError where a joint of an arm is passive: its coordinate is no command.
        """
        roles = self.robot.legs[0].chain.roles
        if self.robot.is_posed_by_joints and not all(isinstance(role, Actuated) for role in roles):
            raise NoAnswerError(
                f"no commands of {self.robot.name!r}: it has passive or locked joints, whose "
                "coordinates are no commands"
            )
        columns = [
            _between(self._pose(self.start - step), self._pose(self.start + step), self.point)
            for step in _STEP * np.eye(self.start.shape[1])
        ]
        rates = np.stack(columns, axis=-1)[:, self.followed] / (2 * _STEP)
        return np.linalg.pinv(np.nan_to_num(rates), rcond=1e-9)


def _between(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Shift of a point and rotation (N, 6) from poses to others, world axes."""
    shift = end[:, :3] - start[:, :3] + turned_point(end, point) - turned_point(start, point)
    return np.concatenate([shift, turn_after(end[:, 3:], -start[:, 3:])], axis=1)
