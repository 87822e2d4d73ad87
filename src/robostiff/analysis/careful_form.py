"""The careful form: K_C of a robot with pivots chosen at each pose, and all that a result holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, SnapshotStiffness, solve_snapshot
from robostiff.elastostatics import (
    DEFAULT_TOLERANCE,
    BlockCompliance,
    CartesianStiffness,
    Form,
    Status,
    Tolerance,
    scaling,
)
from robostiff.errors import InputError
from robostiff.kept import kept
from robostiff.kinematics import Near, Posture, PostureFinder, place_chain, posture_finder
from robostiff.kinematics.closure import LegSolver
from robostiff.kinematics.pose import PoseRequest, check_is_not_posed
from robostiff.kinematics.solved_request import ActuatedRequest
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import PlacedLeg, Robot, Snapshot
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.analysis.linkage_stiffness import AskedConfigurations
    from robostiff.analysis.robot_record import RecordedAnswer
    from robostiff.linkage import Linkage
    from robostiff.network import Network

# Of the stiffness of a leg: two postures that differ by less are the same to it.
_SAME = 1e-6
_POSES = 3  # of a batch that are looked at, where the robot has no home


def posture_advice(
    finder: PostureFinder,
    posture_of: Callable[[], Posture],
    tolerance: Tolerance,
) -> tuple[str, ...]:
    """A sentence if the posture of a leg was not chosen, and others have another stiffness.

    A posture is chosen by home coordinates of the leg's joints, by an elbow, by joint coordinates
    or by `near`. Legs of which none is given are looked at, at home, or at a few of the poses of a
    robot without home. Home coordinates choose none for a leg whose drives can move while the
    platform stands still. `posture_of` gives the posture of a robot without home.
    """
    if finder.robot.home is not None:  # of the robot as a whole, whatever the poses
        return _advice_at_home(finder, tolerance)
    return _advice_on(posture_of(), finder, tolerance)


@kept
def _advice_at_home(finder: PostureFinder, tolerance: Tolerance) -> tuple[str, ...]:
    return _advice_on(finder.find(None), finder, tolerance)


def _advice_on(posture: Posture, finder: PostureFinder, tolerance: Tolerance) -> tuple[str, ...]:
    rows = np.flatnonzero(posture.reached)
    if rows.size > _POSES:
        rows = rows[np.linspace(0, rows.size - 1, _POSES, dtype=int)]
    names = []
    moving = []
    for solver, q in zip(finder.solvers, posture.coordinates, strict=True):
        if solver.has_redundant_drives:
            moving.append(repr(solver.leg.name))
            continue
        if finder.robot.is_posed_by_joints:
            given = bool(np.any(solver.leg.chain.home_given))
        else:
            given = solver.posture_is_given
        if given:
            continue
        if any(_matters(finder, solver, posture.pose[i], q[i], tolerance) for i in rows):
            names.append(repr(solver.leg.name))
    advice = [
        f"the drives of leg {name} can move while the platform stands still, and the pose alone "
        "does not say how it stands: the posture nearest to home is taken; choose one by joint "
        "coordinates close by: near=[...]"
        for name in moving
    ]
    if names:
        legs = f"leg {names[0]} reaches" if len(names) == 1 else f"legs {', '.join(names)} reach"
        advice.insert(
            0,
            f"{legs} the pose in several postures of different stiffness, and none was chosen: "
            "give home coordinates to the joints, or joint coordinates close by: near=[...]",
        )
    return tuple(advice)


def _matters(
    finder: PostureFinder,
    solver: LegSolver,
    pose: np.ndarray,
    q: np.ndarray,
    tolerance: Tolerance,
) -> bool:
    others = solver.alternatives(pose)
    if not len(others):
        return False
    leg, robot = solver.leg, finder.robot
    every = np.concatenate([q[None], others])
    placed = place_chain(leg.chain, every, leg.base.R, leg.base.p)
    own = PlacedLeg(leg.name, placed.elements, placed.p)
    at = np.broadcast_to(placed.p[0], placed.p.shape)
    snapshot = Snapshot(robot.name, (own,), at, robot.space)
    K = solve_snapshot(snapshot, DEFAULT_METHOD, tolerance).legs[0].matrix
    s = scaling(np.array(finder.length), robot.space)
    K = K / np.outer(s, s)
    apart = np.max(np.abs(K[1:] - K[0]), axis=(-1, -2))
    return bool(np.any(apart > _SAME * np.max(np.abs(K[0]))))


#: Poses worked on at once: few enough for the cache, enough to hide the cost of a NumPy call.
CHUNK = 4096
# What a posture has to complain of has one of these.
_COMPLAINTS = Status.UNREACHABLE | Status.BEYOND_LIMITS | Status.ILL_CONDITIONED


@dataclass(frozen=True)
class AskedPoses:
    """Poses of a robot, and the way in which its stiffness at them is asked for."""

    finder: PostureFinder  # of the robot
    # PoseRequest or (..., size): the latter are joint coordinates
    request: PoseRequest | np.ndarray
    method: Form = DEFAULT_METHOD
    near: Near = None
    tolerance: Tolerance = DEFAULT_TOLERANCE

    opinions: ClassVar = "the record of a robot and the wrench basis form"
    free: ClassVar = 1e-6  # of the largest size: what rounding leaves of zero

    @property
    def name(self) -> str:
        """Of the robot."""
        return self.finder.robot.name

    @property
    def space(self) -> Space:
        """Spatial (6 x 6) or planar (3 x 3)."""
        return self.finder.robot.space

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch, () for one pose."""
        request = self.request
        return request.shape[:-1] if isinstance(request, np.ndarray) else request.batch

    @property
    def numbers(self) -> np.ndarray:
        """Pose coordinates (N, 6), or joint coordinates (N, size), one pose a row."""
        request = self.request
        if isinstance(request, np.ndarray):
            return request.reshape(int(np.prod(self.batch, dtype=int)), request.shape[-1])
        return request.coordinates

    def pose_at(self, rows: np.ndarray) -> np.ndarray | None:
        """Pose coordinates (..., 6) where all of them are given."""
        if isinstance(self.request, np.ndarray) or self.request.open:
            return None
        return self.request.coordinates[rows]

    def reference_points(self, rows: np.ndarray) -> np.ndarray | None:
        """The robot's reference point in the world (..., 3) [m], where all of the pose is given."""
        pose = self.pose_at(rows)
        if pose is None or isinstance(self.request, np.ndarray):
            return None
        given = self.request.turned
        R = turn_by_vector(pose[..., 3:]) if given is None else given[rows]
        return pose[..., :3] + np.einsum("...ij,j->...i", R, self.finder.robot.reference_point)

    def recorded(self) -> RecordedAnswer | None:
        """What the record gives; None where there is none, or it does not pay yet."""
        from robostiff.analysis.robot_record import recorded_answer

        return recorded_answer(self.finder.robot, self)

    def placed(self, row: np.ndarray) -> Snapshot:
        """The robot in the world at one pose."""
        return self.posture(row.reshape(1)).snapshot.one(0)

    def posture(self, rows: slice | np.ndarray) -> Posture:
        """The posture at some of the poses; of one pose it is found once."""
        return self._at(rows) if self.batch else self._only

    @cached_property
    def _only(self) -> Posture:
        return self._at(slice(None))

    def _at(self, rows: slice | np.ndarray) -> Posture:
        asked = self.request
        wanted = self.numbers[rows] if isinstance(asked, np.ndarray) else asked.part(rows)
        return self.finder.at(wanted, self.near)

    def solved(self, rows: np.ndarray) -> RobotStiffness:
        """The careful form at some of the poses, with the shape of the rows."""
        parts, flat = [], rows.reshape(-1)
        for start in range(0, max(flat.size, 1), CHUNK):
            posture = self.posture(flat[start : start + CHUNK])
            solved = solve_snapshot(posture.snapshot, self.method, self.tolerance)
            reached, whole = posture.reached, solved.whole
            status = (
                np.where(reached, whole.status_codes, np.uint16(Status.UNREACHABLE))
                | (reached & ~posture.within_limits) * np.uint16(Status.BEYOND_LIMITS)
                | (reached & posture.undetermined) * np.uint16(Status.ILL_CONDITIONED)
            )
            whole = replace(whole, status_codes=np.asarray(status, dtype=np.uint16))
            parts.append((posture, replace(solved, whole=whole)))
        return _joined(self.finder.robot, parts, rows.shape, self.method)

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """What is to be said of one pose of that status, or of several, beside their status."""
        found: tuple[str, ...] = ()
        flat = rows.reshape(-1)[:CHUNK]
        by_drives = isinstance(self.request, ActuatedRequest | np.ndarray)
        if not rows.shape and status & _COMPLAINTS:
            posture = self.posture(flat)
            found = posture.complaints
            if not by_drives and self.near is None and status & Status.UNREACHABLE:
                found = (*found, *self.finder.in_other_modes(posture))
        if self.near is not None or by_drives:
            return found
        advice = posture_advice(self.finder, lambda: self.posture(flat), self.tolerance)
        return (*found, *advice)


def careful_stiffness(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Any = None,
    *,
    method: Form = DEFAULT_METHOD,
    near: Near = None,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> RobotStiffness:
    """As `stiffness`, but never by the record of the robot, and with all that a result holds.

    For what is going to ask for legs, compliance or loads, and for what checks a record.
    """
    asked = asked_of(robot, pose, method, near, tolerance)
    if asked is not None:
        rows = np.arange(len(asked.numbers)).reshape(asked.batch)
        result = asked.solved(rows)
        complaints = (*result.complaints, *asked.complaints(rows, result.status))
        return replace(result, complaints=complaints)
    if not isinstance(robot, Snapshot):
        check_is_default(method, "network", robot.name)
        from robostiff.analysis.linkage_stiffness import network_stiffness

        return network_stiffness(cast("Network", robot), tolerance)
    solved = solve_snapshot(robot, method, tolerance)
    return RobotStiffness(
        name=robot.name,
        pose=None,
        reference_point=robot.reference_point,
        about_reference=solved.whole,
        legs=solved.legs,
        passive_joint_names=solved.passive_joint_names,
        method=method,
        complaints=(),
        serial_compliance=solved.compliance,
        origin=solved.origin,
        leg_blocks=solved.leg_blocks,
    )


def asked_of(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Any,
    method: Form,
    near: Near,
    tolerance: Tolerance,
) -> AskedPoses | AskedConfigurations | None:
    """Poses or configurations that are asked for; None of what has a pose of its own."""
    check_arguments(robot, method, near, tolerance)
    if isinstance(robot, Robot):
        finder = posture_finder(robot)
        return AskedPoses(finder, finder.request(pose), method, near, tolerance)
    from robostiff.linkage import Linkage

    if isinstance(robot, Linkage):
        from robostiff.analysis.linkage_stiffness import AskedConfigurations

        return AskedConfigurations.of(robot, pose, tolerance, method)
    check_is_not_posed(robot, pose)
    return None


def check_is_default(method: Form, kind: str, name: str) -> None:
    """Raise for a form of K_C where there are no legs."""
    if method != DEFAULT_METHOD:
        raise InputError(
            f"method for {kind} {name!r}",
            got=method.name,
            expected=f"none: forms of K_C are of legs, and a {kind} is solved as a whole",
        )


def check_arguments(robot: Any, method: Any, near: Near, tolerance: Any) -> None:
    """Raise for what `stiffness` does not take."""
    if isinstance(robot, Robot | Snapshot):
        robot.check_has_no_springs("stiffness without load")
    else:
        from robostiff.linkage import Linkage
        from robostiff.model.cable import CableRobot
        from robostiff.network import Network

        if not isinstance(robot, Network | Linkage | CableRobot):
            raise InputError(
                "robot",
                got=robot,
                expected="a Robot, a Snapshot, a Network, a Linkage or a CableRobot",
                hint='write load("hexapod")',
            )
    if isinstance(method, type) or not isinstance(method, Form):
        name = method.__name__ if isinstance(method, type) else "WrenchBasis"
        raise InputError(
            "method", got=method, expected="a form of K_C", hint=f"write method={name}()"
        )
    if not isinstance(tolerance, Tolerance):
        raise InputError(
            "tolerance",
            got=tolerance,
            expected="a Tolerance",
            hint="write tolerance=Tolerance(independence=1e-9)",
        )
    if near is not None and not isinstance(robot, Robot):
        raise InputError(
            f"near of {robot.name!r}",
            got=near,
            expected="none: only a robot of joints and legs has postures to choose from",
        )


def _joined(
    robot: Robot,
    parts: list[tuple[Posture, SnapshotStiffness]],
    batch: tuple[int, ...],
    method: Form,
) -> RobotStiffness:
    first = parts[0][1]
    compliance = None
    if first.compliance is not None:
        compliance = _stacked([part.compliance for _, part in parts], batch)
    return RobotStiffness(
        name=robot.name,
        pose=_stacked([posture.pose for posture, _ in parts], batch),
        reference_point=_stacked([posture.snapshot.reference_point for posture, _ in parts], batch),
        about_reference=_reshaped([part.whole for _, part in parts], batch),
        legs=tuple(
            _reshaped([part.legs[i] for _, part in parts], batch) for i in range(len(first.legs))
        ),
        passive_joint_names=first.passive_joint_names,
        method=method,
        complaints=(),
        joint_coordinates={
            leg.name: _stacked([posture.coordinates[i] for posture, _ in parts], batch)
            for i, leg in enumerate(robot.legs)
        },
        joint_names={leg.name: leg.chain.coordinate_names for leg in robot.legs},
        serial_compliance=compliance,
        origin=_stacked([part.origin for _, part in parts], batch),
        leg_blocks=tuple(
            tuple(BlockCompliance.joined(own, batch) for own in zip(*of_leg, strict=True))
            for of_leg in zip(*(part.leg_blocks for _, part in parts), strict=True)
        ),
    )


def _reshaped(parts: list[CartesianStiffness], batch: tuple[int, ...]) -> CartesianStiffness:
    return CartesianStiffness.joined(parts).reshaped(batch)


def _stacked(parts: list[Any], batch: tuple[int, ...]) -> np.ndarray:
    whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return whole.reshape(*batch, *whole.shape[1:])
