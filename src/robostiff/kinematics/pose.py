"""Poses of the platform: coordinates, rigid transforms, joint coordinates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words, warn_of_slip
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.kinematics.machine_pose import ActuatorCoordinates, ToolPose
from robostiff.kinematics.turn import turn_about, turn_by_vector
from robostiff.model import ALL_COORDINATES, Chain, Coupling, Joint, Leg, Link, Locked, Rigid, Robot
from robostiff.model.checks import FARTHEST, FULL_TURN
from robostiff.spatial import Frame, Space, as_floats, check_order, cross, holds_quantities
from robostiff.spatial.batch import poses_side_by_side, product
from robostiff.spatial.rotation import is_rigid_transform, nearest_rotation, vector_of_rotation

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

_HELD = 1e-9  # of a held sum of joint coordinates [m or rad]
_NO_ROTATION = 1e-6  # by which R^T R of a given matrix may differ from the identity
_AT_ONCE = 64  # poses whose numbers are compared side by side
_OPPOSITE = 1e-9  # of a half turn: the shortest way there has no direction


@frozen
class JointCoordinates:
    """A posture given by the joint coordinates of a serial arm.

    Attributes
    ----------
    values : (..., size) array
        Coordinates of all joints from base to tool [m, rad].
    """

    values: ArrayLike


Pose: TypeAlias = (
    "RigidTransform | Frame | JointCoordinates | ActuatorCoordinates | ToolPose | ArrayLike | None"
)

#: Poses that are one for certain; an array may be many.
OnePose: TypeAlias = Sequence[float] | Frame | None


class Given(Enum):
    """What says where a robot is."""

    POSE = "pose of the platform"
    JOINTS = "coordinates of all joints of a serial arm"
    DRIVES = "coordinates of the actuated joints"
    TOOL = "tip and axis of the tool, which turns about it as the legs demand"


@frozen
class PoseRequest:
    """Postures that are asked for, one in each row."""

    batch: tuple[int, ...]  # shape of the given batch
    # Of poses (N, 6): x, y, z and rotation vector, the open ones those of home. Else (N, n): joint
    # coordinates; or tip and unit axis of the tool
    coordinates: np.ndarray
    open: tuple[int, ...] = ()  # pose coordinates that the legs decide
    # (N, 3, 3) or None: rotation of the platform where it was given as a matrix
    turned: np.ndarray | None = None
    by: Given = Given.POSE
    tool_axis: np.ndarray | None = None  # (3,): of a tool, in the platform frame

    @cached_property
    def R(self) -> np.ndarray:
        """Rotation of the platform (N, 3, 3)."""
        return turn_by_vector(self.coordinates[:, 3:]) if self.turned is None else self.turned

    @property
    def numbers(self) -> np.ndarray:
        """The coordinates with the shape of the batch (..., n)."""
        return self.coordinates.reshape(*self.batch, self.coordinates.shape[-1])

    @property
    def is_whole(self) -> bool:
        """Whether poses are given by all of their six coordinates."""
        return self.by is Given.POSE and not self.open

    @property
    def by_drives(self) -> bool:
        """Whether its numbers are coordinates of drives, which determine the posture."""
        return self.by in (Given.JOINTS, Given.DRIVES)

    def part(self, rows: slice | np.ndarray) -> PoseRequest:
        """Some of the poses, side by side."""
        turned, own = self.turned, poses_side_by_side(self.coordinates[rows], 1)
        return replace(
            self,
            batch=own.shape[:1],
            coordinates=own,
            turned=None if turned is None else poses_side_by_side(turned[rows], 2),
        )


Near = JointCoordinates | ArrayLike | Sequence[ArrayLike] | Mapping[str, ArrayLike] | None


def near_coordinates(robot: Robot, near: Near) -> tuple[np.ndarray, ...] | None:
    """Joint coordinates of each leg that choose a posture, by name, leg by leg or all in a row.

    Raises InputError when they are not as many finite numbers as the legs have coordinates.
    """
    if near is None:
        return None
    given: Any = near.values if isinstance(near, JointCoordinates) else near
    subject, sizes = f"near of {robot.name!r}", [leg.chain.size for leg in robot.legs]
    units = [joint_units(leg.chain) for leg in robot.legs]
    every = f"{sum(sizes)} joint coordinates [m, rad]"
    expected = every if robot.is_serial else f"{every}, or one list for each of {len(sizes)} legs"
    if isinstance(given, Mapping):
        names = [leg.name for leg in robot.legs]
        if set(given) != set(names):
            expected = f"coordinates of the legs {', '.join(names)}"
            raise InputError(subject, got=", ".join(map(str, given)) or "none", expected=expected)
        given = [given[name] for name in names]
    parts = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else []
    if len(parts) == len(sizes) and all(np.ndim(part) == 1 for part in parts):
        each = zip(parts, units, strict=True)
        flat = np.concatenate([as_floats(subject, part, expected, own) for part, own in each])
        fits = [len(part) for part in parts] == sizes
    else:
        flat = as_floats(subject, given, expected, [unit for own in units for unit in own]).ravel()
        fits = flat.size == sum(sizes)
    if not fits:
        hint = f"the legs have {', '.join(map(str, sizes))} coordinates each, passive ones included"
        raise InputError(subject, got=given, expected=expected, hint=hint)
    each = zip(robot.legs, np.split(flat, np.cumsum(sizes)[:-1]), strict=True)
    return tuple(
        np.where(leg.chain.free, own, leg.chain.home) if leg.chain.is_coupled else own
        for leg, own in each
    )


def check_is_not_posed(robot: Any, pose: object) -> None:
    """Raise for a pose of a snapshot or a network."""
    if pose is not None:
        kind = type(robot).__name__.lower()
        expected = f"none: a {kind} is frozen at its own pose"
        hint = "describe the robot in a model file, or use rs.load_linkage, to move it"
        raise InputError(f"pose of {kind} {robot.name!r}", got=pose, expected=expected, hint=hint)


@kept
def coordinate_units(robot: Robot) -> tuple[str, ...]:
    """SI units of the free pose coordinates of a robot, m or rad."""
    return tuple(Space.SPATIAL.twist_units[place] for place in robot.coordinate_places)


def joint_units(chain: Chain) -> tuple[str, ...]:
    """SI units of the joint coordinates of a chain, m or rad."""
    return tuple(screw.unit for screw in chain.freedoms)


@kept
def home_coordinates(robot: Robot) -> np.ndarray:
    """Pose coordinates (x, y, z, rotation vector) of the home configuration (6,) [m, rad]."""
    if robot.home is not None:
        return six_coordinates(nearest_rotation(robot.home.R), robot.home.p)
    return pose_of_end(robot.legs[0], robot.legs[0].chain.home)


def pose_of_end(leg: Leg, q: np.ndarray) -> np.ndarray:
    """Pose coordinates (6,) of the platform at the end of a leg."""
    placed = place_chain(leg.chain, q, leg.base.R, leg.base.p)
    return six_coordinates(*platform_at_end(leg, placed))


def platform_at_end(leg: Leg, placed: PlacedChain) -> tuple[np.ndarray, np.ndarray]:
    """Axes (..., 3, 3) and origin (..., 3) of the platform at the end of a placed leg."""
    tool = leg.attachment.inverse
    return placed.R @ tool.R, placed.p + placed.R @ tool.p


def requested_pose(robot: Robot, pose: Pose, home: np.ndarray | None = None) -> PoseRequest:
    """Read a pose: a rigid transform, the coordinates that are free, all six, or none for home.

    A transform may be a matrix (..., 4, 4) or a frame.

    The coordinates of home (6,) may be given where they are known.

    Raises InputError when the numbers are not finite, or as many as the robot has free coordinates,
    or six.
    """
    home = home_coordinates(robot) if home is None else home
    if pose is None:
        return PoseRequest((), home[None, :].copy())
    T = _matrices(robot, pose)
    if T is not None:
        R = T[..., :3, :3]
        six = six_coordinates(R, T[..., :3, 3]).reshape(-1, 6)
        _check_plane(robot, six, home)
        return PoseRequest(T.shape[:-2], six, (), R.reshape(-1, 3, 3))
    if isinstance(pose, JointCoordinates):
        raise InputError(
            f"pose of {robot.name!r}",
            got=Words("joint coordinates"),
            expected="a platform pose: joint coordinates pose serial arms only",
            hint="ActuatorCoordinates([...]) gives those of the actuated joints alone",
        )
    names = [coordinate.value for coordinate in robot.coordinates]
    free = f"{len(names)} numbers ({' '.join(names)}) or " if 0 < len(names) < 6 else ""
    expected = f"{free}6 numbers (x y z rx ry rz) in the last axis"
    units = {6: Space.SPATIAL.twist_units, len(names): coordinate_units(robot)}
    check_order(f"pose of {robot.name!r}", pose, names, [own.value for own in ALL_COORDINATES])
    given = as_floats(f"pose of {robot.name!r}", pose, expected, units)
    fits = {len(names), 6} if names or not robot.is_posed_by_joints else {6}
    if given.ndim == 0 or given.shape[-1] not in fits:
        subject = f"shape of the pose of {robot.name!r}"
        hint = _HINT if _may_be_joints(robot, given) else None
        raise InputError(subject, got=given.shape, expected=expected, hint=hint)
    batch = given.shape[:-1]
    rows = given.reshape(math.prod(batch), given.shape[-1])
    if rows.shape[-1] == 6:
        _question(robot, rows, home)
        _check_plane(robot, rows, home)
        return PoseRequest(batch, rows)
    coordinates = np.tile(home, (len(rows), 1))
    chosen = robot.coordinate_places
    coordinates[:, chosen] = rows
    _question(robot, coordinates, home)
    open_ = tuple(k for k in robot.space.rows if k not in chosen)
    return PoseRequest(batch, coordinates, open_)


def _matrices(robot: Robot, pose: Pose) -> np.ndarray | None:
    """Matrices (..., 4, 4) of a rigid transform, a frame, or such matrices; None of other poses.

    Of a robot with four free coordinates, four rows of four numbers are four poses.
    """
    if isinstance(pose, Frame):
        return pose.matrix
    subject, expected = f"pose of {robot.name!r}", "numbers of shape (..., 4, 4)"
    if is_rigid_transform(pose):
        return as_floats(subject, pose.as_matrix(), "a rigid transform")
    sizes, part = [], pose  # of the last two axes, of the first entries where they are lists
    while isinstance(part, list | tuple) and part:
        sizes, part = [*sizes, len(part)], part[0]
    innermost = (*sizes, *getattr(part, "shape", ()))[-2:]
    if len(robot.coordinates) == 4 or innermost != (4, 4) or holds_quantities(pose):
        return None
    T = as_floats(subject, pose, expected)
    R = T[..., :3, :3]
    error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0)
    if np.any(T[..., 3, :] != (0, 0, 0, 1)) or error > _NO_ROTATION or np.any(np.linalg.det(R) < 0):
        raise InputError(
            subject,
            got=pose,
            expected="rigid transforms: a rotation, a place [m], and 0 0 0 1 in the last row",
        )
    T = T.copy()
    T[..., :3, :3] = nearest_rotation(R)
    return T


_HINT = "did you mean JointCoordinates([...])? --joints on the command line"


def _may_be_joints(robot: Robot, given: np.ndarray) -> bool:
    """Whether there are as many numbers as joints of a serial arm."""
    # Robots with cables are posed here, too, and are no arms.
    is_arm = getattr(robot, "is_serial", False)
    return is_arm and given.ndim > 0 and given.shape[-1] == robot.legs[0].chain.size


def requested_joints(robot: Robot, pose: JointCoordinates) -> PoseRequest:
    """Read joint coordinates (..., size) of a serial arm.

    Raises InputError when they are not as many finite numbers as it has joints, or not what its
    couplings hold.
    """
    chain, subject = robot.legs[0].chain, f"joint coordinates of {robot.name!r}"
    words = f"{chain.size} finite numbers in the last axis: {' '.join(chain.coordinate_names)}"
    check_order(subject, pose.values, chain.coordinate_names)
    q = as_floats(subject, pose.values, words, joint_units(chain))
    if q.ndim == 0 or q.shape[-1] != chain.size:
        raise InputError(subject, got=pose.values, expected=words)
    if q.size:
        rotates = np.array([screw.is_rotation for screw in chain.freedoms], bool)
        if np.max(np.abs(q), where=rotates, initial=0.0) > 2 * FULL_TURN:
            warn_of_slip(f"{subject}: angles beyond two turns; in degrees?")
        advances = [screw.advance(q[..., i]) for i, screw in enumerate(chain.freedoms)]
        if np.max(np.abs(advances)) > FARTHEST:
            warn_of_slip(f"{subject}: slides beyond {FARTHEST:g} m; in mm?")
        check_held_sums(robot, q)
    return rows_of(q, Given.JOINTS)


def rows_of(numbers: np.ndarray, by: Given, tool_axis: np.ndarray | None = None) -> PoseRequest:
    """A request by numbers (..., n) that are no poses."""
    batch = numbers.shape[:-1]
    rows = poses_side_by_side(numbers.reshape(math.prod(batch), numbers.shape[-1]), 1)
    return PoseRequest(batch, rows, by=by, tool_axis=tool_axis)


def requested_tool(robot: Robot, pose: ToolPose, home: np.ndarray) -> PoseRequest:
    """Read poses of the tool of a robot with pose coordinates (6,) at home.

    Raises InputError when they do not fit.
    """
    tip, axis, own = pose.numbers(robot)
    numbers = np.concatenate([tip, axis], axis=-1)
    freedoms = len(robot.coordinates)
    if robot.is_posed_by_joints:
        freedoms = np.count_nonzero(robot.legs[0].chain.free)
    if pose.spin is None and freedoms < len(ALL_COORDINATES):
        return rows_of(numbers, Given.TOOL, own)
    spin = np.zeros(())
    if pose.spin is not None:
        subject = f"tool pose of {robot.name!r}, spin"
        spin = as_floats(subject, pose.spin, "finite angles [rad]", "rad")
    batch = np.broadcast_shapes(spin.shape, numbers.shape[:-1])
    rows = np.broadcast_to(numbers, (*batch, 6)).reshape(math.prod(batch), 6)
    R = shortest_turn(home, rows[:, 3:], own)
    R = product(R, turn_about(own, np.broadcast_to(spin, batch).reshape(-1)))
    p = rows[:, :3] - np.einsum("nij,j->ni", R, robot.reference_point)
    coordinates = poses_side_by_side(six_coordinates(R, p), 1)
    return PoseRequest(batch, coordinates, turned=poses_side_by_side(R, 2))


def shortest_turn(home: np.ndarray, axis: np.ndarray, tool_axis: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) of the platform that turn the tool axis of home the shortest way.

    Home is given by its pose coordinates (6,), the wanted directions (N, 3) in the world, and the
    tool axis (3,) in the platform frame.
    """
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
    return product(turn_by_vector(unit * angle[:, None]), R_home)


def held_sums(chain: Chain) -> Iterator[tuple[int, Coupling]]:
    """Coordinates of a chain that couplings hold: the place of each, and the coupling."""
    sums = {} if chain.transmission is None else chain.transmission.sums
    for i, own in sums.items():
        if isinstance(own.role, Locked):
            yield chain.own_places[i], own


def check_held_sums(robot: Robot, q: np.ndarray) -> None:
    """Raise where coordinates (..., size) of a serial arm are not what its couplings hold.

    Raises InputError naming the coupling.
    """
    chain = robot.legs[0].chain
    if not q.size:
        return
    for place, own in held_sums(chain):
        held, given = float(chain.home[place]), q[..., place]
        if np.any(np.abs(given - held) > _HELD):
            worst = np.ravel(given)[np.argmax(np.abs(np.ravel(given) - held))]
            raise InputError(
                f"coordinate {place + 1} of {robot.name!r}",
                got=round(float(worst), 10),
                expected=f"{held:.10g}: it is the sum {own.in_words}, which is held",
                hint="the joint follows the others by itself",
            )


def _question(robot: Robot, rows: np.ndarray, home: np.ndarray) -> None:
    """Warn of poses (N, 6) that are probably in other units, or no poses at all."""
    if not rows.size:
        return
    subject = f"pose of {robot.name!r}"
    # NumPy is slow along long thin arrays: many poses side by side are compared first.
    n, wide = rows.shape[1], rows
    if rows.flags.c_contiguous and len(rows) > 2 * _AT_ONCE:
        most = len(rows) - len(rows) % _AT_ONCE
        every = rows[:most].reshape(-1, _AT_ONCE * n)
        ends = (own.reshape(-1, n) for own in (every.min(axis=0), every.max(axis=0)))
        wide = np.concatenate([*ends, rows[most:]])
    low, high = wide.min(axis=0), wide.max(axis=0)
    most = np.maximum(np.abs(low), np.abs(high))[3:]
    if max(np.max(high[:3] - home[:3]), np.max(home[:3] - low[:3])) > FARTHEST:
        warn_of_slip(f"{subject}: a place more than {FARTHEST:g} m from home; in mm?")
    elif most @ most > FULL_TURN**2 and np.max(np.sum(rows[:, 3:] ** 2, axis=1)) > FULL_TURN**2:
        warn_of_slip(f"{subject}: a rotation vector of more than a turn; in degrees?")
    elif _may_be_joints(robot, rows):
        leg = robot.legs[0]
        span = float(np.linalg.norm(leg.attachment.p))  # of turning joints, the farthest reach
        for element in leg.chain.elements:
            if isinstance(element, Rigid | Link):
                to = element.to if isinstance(element, Link) else element.transform.p
                span += float(np.linalg.norm(to))
            elif not isinstance(element, Joint) or any(own.slides for own in element.freedoms):
                span = math.inf
        if np.all(np.linalg.norm(rows[:, :3] - leg.base.p, axis=1) > span):
            warn_of_slip(f"{subject}: places that the arm is too short to reach; {_HINT}")


def _check_plane(robot: Robot, rows: np.ndarray, home: np.ndarray) -> None:
    """Raise when a pose of a planar robot leaves the plane of its home."""
    if robot.space is not Space.PLANAR:
        return
    out = [k for k in range(6) if k not in Space.PLANAR.rows]
    if np.any(np.abs(rows[:, out] - home[out]) > 1e-9):
        kept = ", ".join(f"{ALL_COORDINATES[k].value} = {home[k]:g}" for k in out)
        raise InputError(
            f"pose of the planar robot {robot.name!r}",
            got=Words("a pose out of its plane"),
            expected=f"{kept}, as at home",
            hint="write x y rz alone",
        )


def six_coordinates(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Origin and rotation vector (..., 6) of axes (..., 3, 3) at an origin (..., 3)."""
    return np.concatenate([p, vector_of_rotation(R)], axis=-1)
