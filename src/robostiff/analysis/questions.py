"""Poses of robots, snapshots and networks at which their stiffness is asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from robostiff.analysis.details import Details, Question, StructuralAnalysis
from robostiff.analysis.robot_record import record_of
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.elastostatics import DEFAULT_TOLERANCE, Form, Status, Tolerance, scaling
from robostiff.kept import kept
from robostiff.kinematics import (
    JointCoordinates,
    Near,
    Posture,
    PostureFinder,
    place_chain,
    posture_finder,
)
from robostiff.kinematics.closure import LegSolver
from robostiff.kinematics.pose import PoseRequest
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import PlacedLeg, Robot, Snapshot
from robostiff.model.checks import FARTHEST, FULL_TURN

if TYPE_CHECKING:
    from robostiff.analysis.compiled_answer import CompiledAnswer
    from robostiff.kinematics import Pose
    from robostiff.network import Network

#: Poses worked on at once: few enough for the cache, enough to hide the cost of a NumPy call.
CHUNK = 4096
# What a posture has to complain of has one of these.
_COMPLAINTS = Status.UNREACHABLE | Status.BEYOND_LIMITS | Status.ILL_CONDITIONED


class PosesOfRobot(Question):
    """Poses of a robot of legs."""

    finder: PostureFinder
    form: Form
    near: Near
    #: A PoseRequest, or joint coordinates (..., size).
    request: PoseRequest | np.ndarray
    numbers: np.ndarray
    opinions: ClassVar[str] = "the record of a robot and the wrench basis form"
    free: ClassVar[float] = 1e-6

    def __init__(
        self,
        robot: Robot,
        pose: Pose | PoseRequest,
        method: Form = DEFAULT_METHOD,
        near: Near = None,
        tolerance: Tolerance = DEFAULT_TOLERANCE,
    ) -> None:
        self.finder, self.form, self.near = posture_finder(robot), method, near
        self._only: Posture | None = None
        is_read = type(pose) is PoseRequest
        self.request = request = pose if is_read else self.finder.request(cast("Pose", pose))
        by_joints = isinstance(request, np.ndarray)
        batch = request.shape[:-1] if by_joints else request.batch
        super().__init__(robot.name, robot.space, method, tolerance, batch)
        # Pose coordinates (N, 6), or joint coordinates (N, size), one pose a row.
        self.numbers = (
            request.reshape(self.rows.size, request.shape[-1]) if by_joints else request.coordinates
        )

    @classmethod
    def recorded_at_one(cls, robot: Robot, pose: Any) -> PosesOfRobot | None:
        """One pose of free coordinates in plain numbers, answered by the record of the robot.

        None of other poses, and where the record does not answer at once: for `stiffness`, which
        then reads and answers the pose as any other.
        """
        record = record_of(robot)
        if record.compiled is None:
            return None
        places, home = _plain_coordinates(robot)
        numbers = pose.tolist() if type(pose) is np.ndarray else pose
        if type(numbers) is not list or len(numbers) != len(places):
            return None
        turned = 0.0
        for place, x in zip(places, numbers, strict=True):
            if not (isinstance(x, float) or type(x) is int):
                return None
            if place < 3 and not abs(x - home[place]) <= FARTHEST:
                return None
            turned += x * x if place >= 3 else 0.0
        given = np.array(numbers, dtype=float)
        if not turned <= FULL_TURN**2 or (found := record.answer_at_one(given)) is None:
            return None
        coordinates = home.copy()
        coordinates[places] = given
        left = tuple(place for place in robot.space.rows if place not in places)
        question = cls(robot, PoseRequest((), coordinates[None], left))
        question.recorded = found
        return question

    def place(self, row: int) -> list[float]:
        """The numbers of one pose [m, rad]."""
        return self.numbers[row].tolist()

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

    def placed(self, row: np.ndarray) -> Snapshot:
        """The robot in the world at one pose."""
        return self._posture(row.reshape(1)).snapshot.one(0)

    def from_record(self) -> CompiledAnswer | None:
        """What the record gives; None where the direct form is to be used.

        That is so for other methods, tolerances and postures than a record has, for robots that
        have none, and until a record pays.
        """
        given = self._inputs()
        if given is None or not given.size:  # no poses, or a structure that has one alone
            return None
        robot = self.finder.robot
        by_joints = robot.is_posed_by_joints
        answer = record_of(robot).answer(JointCoordinates(given) if by_joints else given)
        return None if answer is None else answer.reshaped(self.rows.shape)

    def _inputs(self) -> np.ndarray | None:
        """Free coordinates of poses (N, n), where they are asked for as a record gives them."""
        request, numbers, robot = self.request, self.numbers, self.finder.robot
        if (
            self.near is not None
            or (not isinstance(request, np.ndarray) and request.find is not None)
            or self.form != DEFAULT_METHOD
            or self.tolerance != DEFAULT_TOLERANCE
        ):
            return None
        if isinstance(request, np.ndarray):
            return numbers if robot.is_posed_by_joints else None
        if robot.is_posed_by_joints:
            return None
        free = [place for place in robot.coordinate_places if place in robot.space.rows]
        left = tuple(place for place in robot.space.rows if place not in free)
        # Where the legs decide the others, those of home are right at home alone.
        at_home = not request.batch and np.array_equal(numbers[0], self.finder.home_pose)
        if not free or not (request.open == left or at_home):
            return None
        return numbers if free == list(range(numbers.shape[1])) else numbers[:, free]

    def _posture(self, rows: np.ndarray) -> Posture:
        """The posture at some of the poses; of one pose it is found once."""
        if self._only is None or self.rows.shape:
            asked = self.request
            wanted = self.numbers[rows] if isinstance(asked, np.ndarray) else asked.part(rows)
            self._only = self.finder.at(wanted, self.near)
        return self._only

    def solved(self, rows: np.ndarray) -> Details:
        """The chosen form at N of the poses."""
        if rows.size > CHUNK:
            starts = range(0, rows.size, CHUNK)
            return Details.joined([self.solved(rows[start : start + CHUNK]) for start in starts])
        posture = self._posture(rows)
        found = solve_snapshot(posture.snapshot, self.form, self.tolerance)
        reached, whole = posture.reached, found.whole
        status = (
            np.where(reached, whole.status_codes, np.uint16(Status.UNREACHABLE))
            | (reached & ~posture.within_limits) * np.uint16(Status.BEYOND_LIMITS)
            | (reached & posture.undetermined) * np.uint16(Status.ILL_CONDITIONED)
        )
        legs = self.finder.robot.legs
        each = zip(legs, posture.coordinates, strict=True)
        return replace(
            found,
            whole=replace(whole, status_codes=np.asarray(status, dtype=np.uint16)),
            pose=posture.pose,
            joint_coordinates={leg.name: q for leg, q in each},
            joint_names={leg.name: leg.chain.coordinate_names for leg in legs},
        )

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """What is to be said of one pose of that status, or of several, beside their status."""
        found: tuple[str, ...] = ()
        flat = rows.reshape(-1)[:CHUNK]
        by_drives = isinstance(self.request, np.ndarray) or self.request.by_drives
        if not rows.shape and status & _COMPLAINTS:
            posture = self._posture(flat)
            found = posture.complaints
            if not by_drives and self.near is None and status & Status.UNREACHABLE:
                found = (*found, *self.finder.in_other_modes(posture))
        if self.near is not None or by_drives:
            return found
        if self.finder.robot.home is not None:  # of the robot as a whole, whatever the poses
            return (*found, *_advice_at_home(self.finder, self.tolerance))
        return (*found, *_advice_on(self._posture(flat), self.finder, self.tolerance))


class OwnPose(Question):
    """A snapshot or a network, which has a pose of its own; a snapshot may have many."""

    machine: Snapshot | Network

    def __init__(
        self,
        machine: Snapshot | Network,
        method: Form | StructuralAnalysis,
        tolerance: Tolerance,
        found: Details,
    ) -> None:
        super().__init__(machine.name, machine.space, method, tolerance, found.whole.batch_shape)
        self.machine, self._whole = machine, found

    def solved(self, rows: np.ndarray) -> Details:
        """What was found at N of the poses."""
        return self.details(self.rows)[np.unravel_index(rows, self.rows.shape)]

    def placed(self, row: np.ndarray) -> Snapshot | Network:
        """The machine itself, or one pose of a batch along one axis."""
        return self.machine.one(int(row)) if self.rows.shape else self.machine  # type: ignore[union-attr]


@kept
def _plain_coordinates(robot: Robot) -> tuple[list[int], np.ndarray]:
    """Places of free pose coordinates among all six, and those of home; of an arm no places."""
    places = robot.coordinate_places if not robot.is_serial else ()
    inside = all(place in robot.space.rows for place in places)
    return list(places) if inside else [], posture_finder(robot).home_pose


# Of the stiffness of a leg: two postures that differ by less are the same to it.
_SAME = 1e-6
_POSES = 3  # of a batch that are looked at, where the robot has no home


@kept
def _advice_at_home(finder: PostureFinder, tolerance: Tolerance) -> tuple[str, ...]:
    return _advice_on(finder.find(None), finder, tolerance)


def _advice_on(posture: Posture, finder: PostureFinder, tolerance: Tolerance) -> tuple[str, ...]:
    """A sentence if the posture of a leg was not chosen, and others have another stiffness.

    A posture is chosen by home coordinates of the leg's joints, by an elbow, by joint coordinates
    or by `near`. Legs of which none is given are looked at. Home coordinates choose none for a leg
    whose drives can move while the platform stands still.
    """
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
