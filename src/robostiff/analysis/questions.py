"""Poses of machines at which their stiffness is asked for, and what the direct form finds there."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import singledispatch
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD, solve_snapshot
from robostiff.elastostatics import DEFAULT_TOLERANCE, Details, Form, Status, Tolerance, scaling
from robostiff.errors import DisagreementError, InputError
from robostiff.frozen import are_equal, frozen, replace
from robostiff.kept import kept
from robostiff.kinematics import (
    JointCoordinates,
    Near,
    Posture,
    PostureFinder,
    place_chain,
    posture_finder,
)
from robostiff.kinematics.pose import Given, PoseRequest, check_is_not_posed
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import PlacedLeg, Robot, Snapshot
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.analysis.compiled_answer import CompiledAnswer
    from robostiff.kinematics import Pose
    from robostiff.network import Network

# Poses of a batch that are worked out together when they are asked for one by one.
_BLOCK = 64
# Of the size of an entry: by what equal matrices may differ.
_AGREEMENT = 1e-9

Differences = list[tuple[int, float | str]]


@frozen
class StructuralAnalysis:
    """Matrix structural analysis: all bodies and all wrenches between them in one system."""

    name = "network"
    equation = "[[0, A^T], [A, -S]] [x; f] = [F; 0], condensed to the platform"


def distances(K: np.ndarray, other: np.ndarray, scale: np.ndarray, free: float) -> np.ndarray:
    """How far stiffness matrices are from others, (..., n, n) each; scale (..., n) of wrenches.

    Entries are judged by sqrt(K_ii K_jj) of the other, those of free motions not by zero. Where the
    other vanishes as a whole, as that of legs that transmit nothing does, the distance is 0 or
    infinite.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", other), 0.0)) / scale
    size = np.maximum(size, free * np.max(size, axis=-1, keepdims=True)) * scale
    each = size[..., :, None] * size[..., None, :]
    apart = np.abs(K - other)
    parts = np.where(apart == 0, 0.0, np.inf)
    np.divide(apart, each, out=parts, where=each > 0)
    return np.max(parts, axis=(-1, -2))


def differences(
    direct: Details, codes: np.ndarray, rank: np.ndarray, K: np.ndarray, free: float
) -> Differences:
    """Numbers of N poses at which another answer differs from that of the direct form, by how much.

    Differences of the status come first, then of the rank, then of K (N, n, n) about the reference
    point, the largest first; none within rounding, which leaves `free` of zero, as a part of the
    largest size.
    """
    found: Differences = []
    alike = codes == direct.status_codes
    for i in np.flatnonzero(~alike).tolist():
        words = (Status(int(own[i])) for own in (codes, direct.status_codes))
        found.append((i, "on the status, {} and {},".format(*words)))
    same = alike & (rank == direct.rank)
    for i in np.flatnonzero(alike & ~same).tolist():
        found.append((i, f"on the rank, {int(rank[i])} and {int(direct.rank[i])},"))
    rows = np.flatnonzero(same & direct.answered)
    if rows.size:
        scale = scaling(direct.length[rows], direct.space)
        apart = distances(K[rows], direct.at_reference[rows], scale, free)
        order = [i for i in np.argsort(-apart) if not apart[i] <= _AGREEMENT]
        found += [(int(rows[i]), float(apart[i])) for i in order]
    return found


class Question(ABC):
    """Poses of a machine at which its stiffness is asked for, and what was found out there."""

    name: str  # of the machine
    space: Space
    method: Form | StructuralAnalysis
    tolerance: Tolerance
    rows: np.ndarray  # numbers of the poses, of the shape of their batch
    numbers: np.ndarray  # (N, n): what each pose is given by [m, rad]
    asked: tuple[Any, ...]  # of which machine, and where: what an answer differs by
    #: Whether the machine has legs, each of which has forms of K_C; others are solved as a whole.
    has_legs: ClassVar[bool] = True
    #: Whether one pose has several postures, of which the nearest to given ones may be asked for.
    has_postures: ClassVar[bool] = False
    #: Between what a record and the direct form differ.
    opinions: ClassVar[str] = ""
    #: Of the largest size: what rounding leaves of zero.
    free: ClassVar[float] = 0.0
    #: Of how many poses of a batch the direct form takes as long as what its call begins with, and
    #: as recording; and how many a record serves by NumPy before it pays to compile it.
    pays: ClassVar[tuple[int, int, int]] = 0, 0, 0

    def __init__(
        self,
        name: str,
        space: Space,
        method: Form | StructuralAnalysis,
        tolerance: Tolerance,
        batch: tuple[int, ...],
        numbers: np.ndarray,
    ) -> None:
        self.name, self.space, self.method, self.tolerance = name, space, method, tolerance
        self.rows = np.arange(math.prod(batch)).reshape(batch)
        self.numbers = numbers.reshape(self.rows.size, numbers.shape[-1])
        self.recorded: CompiledAnswer | None = None
        self._whole: Details | None = None
        self._blocks: dict[int, Details] = {}
        self._asked_for_one = False

    __hash__: ClassVar[None]  # type: ignore[assignment]  # as any class with __eq__

    def __eq__(self, other: object) -> bool:
        """Whether the same is asked of an equal machine."""
        if not isinstance(other, Question) or type(other) is not type(self):
            return NotImplemented
        own, others = ((x.method, x.tolerance, x.asked) for x in (self, other))
        return are_equal(own, others)

    def details(self, rows: np.ndarray) -> Details:
        """What the direct form finds at some of the poses, with the shape of the rows.

        Raises DisagreementError where it is another answer than that of the record.
        """
        if rows is self.rows or np.array_equal(rows, self.rows):
            if self._whole is None:
                self._whole = self._checked(rows)
            return self._whole
        if self._whole is not None:
            return self._whole[np.unravel_index(rows, self.rows.shape)]
        if rows.shape or not self._asked_for_one:
            self._asked_for_one |= not rows.shape
            return self._checked(rows)
        start = int(rows) // _BLOCK * _BLOCK
        if start not in self._blocks:
            stop = min(start + _BLOCK, self.rows.size)
            self._blocks[start] = self._checked(np.arange(start, stop))
        return self._blocks[start][int(rows) - start]

    def _checked(self, rows: np.ndarray) -> Details:
        flat = rows.reshape(-1)
        found = self.direct_answer(flat)
        if self.recorded is not None:
            own = self.recorded.reshaped((-1,))[flat]
            given = own.status_codes, own.rank, own.matrix
            for i, distance in differences(found, *given, self.free):
                where = f"{self.name!r} at {self.place(flat[i])}"
                raise DisagreementError(self.opinions, distance, where)
        return found if rows.ndim == 1 else found.reshaped(rows.shape)

    def recordable(self) -> tuple[Any, JointCoordinates | np.ndarray] | None:
        """Of what a record answers, with the inputs (N, n) that it takes; None where none does."""
        return None

    @abstractmethod
    def direct_answer(self, rows: np.ndarray) -> Details:
        """What the direct form finds at N of the poses, a batch of them."""

    @abstractmethod
    def placed(self, row: np.ndarray) -> Snapshot | Network:
        """The machine in the world at one pose."""

    def place(self, row: int) -> list[float]:
        """The numbers of one pose [m, rad]."""
        return self.numbers[row].tolist()

    def pose_at(self, rows: np.ndarray) -> np.ndarray | None:
        """Pose coordinates (..., 6) where all of them are given."""
        return None

    def reference_points(self, rows: np.ndarray) -> np.ndarray | None:
        """The reference point in the world (..., 3) [m], where it is known without the posture."""
        return None

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """What is to be said of one pose of that status, or of several, beside their status."""
        return ()


#: Poses worked on at once: few enough for the cache, enough to hide the cost of a NumPy call.
CHUNK = 4096
# What a posture has to complain of has one of these.
_COMPLAINTS = Status.UNREACHABLE | Status.BEYOND_LIMITS | Status.ILL_CONDITIONED


class PosesOfRobot(Question):
    """Poses of a robot of legs."""

    finder: PostureFinder
    form: Form
    near: Near
    request: PoseRequest
    has_postures: ClassVar[bool] = True
    opinions: ClassVar[str] = "the record of a robot and the wrench basis form"
    free: ClassVar[float] = 1e-6
    # Recording takes as long as 3,000 to 9,000 poses of a batch, or 10 to 30 calls (all shipped
    # robots). Machine code is some 0.5 us a pose faster than NumPy, and takes 0.1 s to compile
    # after 0.5 s to load the compiler.
    pays: ClassVar[tuple[int, int, int]] = 250, 6_000, 2**20

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
        self.asked: tuple[Any, ...] = (robot, request, near)
        numbers = request.coordinates
        super().__init__(robot.name, robot.space, method, tolerance, request.batch, numbers)

    def pose_at(self, rows: np.ndarray) -> np.ndarray | None:
        """Pose coordinates (..., 6) where all of them are given."""
        return self.request.coordinates[rows] if self.request.is_whole else None

    def reference_points(self, rows: np.ndarray) -> np.ndarray | None:
        """The robot's reference point in the world (..., 3) [m], where all of the pose is given."""
        pose = self.pose_at(rows)
        if pose is None:
            return None
        given = self.request.turned
        R = turn_by_vector(pose[..., 3:]) if given is None else given[rows]
        return pose[..., :3] + np.einsum("...ij,j->...i", R, self.finder.robot.reference_point)

    def placed(self, row: np.ndarray) -> Snapshot:
        """The robot in the world at one pose."""
        return self._posture(row.reshape(1)).snapshot.one(0)

    def recordable(self) -> tuple[Any, JointCoordinates | np.ndarray] | None:
        """The robot and its free coordinates, where they are asked for as a record gives them.

        That is not so for other methods, tolerances and postures than a record has. A structure
        has none free, and is asked at home.
        """
        request, numbers, robot = self.request, self.numbers, self.finder.robot
        if (
            self.near is not None
            or not numbers.size
            or request.by is not (Given.JOINTS if robot.is_posed_by_joints else Given.POSE)
            or self.form != DEFAULT_METHOD
            or self.tolerance != DEFAULT_TOLERANCE
        ):
            return None
        if request.by is Given.JOINTS:
            return robot, JointCoordinates(numbers)
        free = [place for place in robot.coordinate_places if place in robot.space.rows]
        left = tuple(place for place in robot.space.rows if place not in free)
        # Where the legs decide the others, those of home are right at home alone.
        at_home = not request.batch and np.array_equal(numbers[0], self.finder.home_pose)
        if not (request.open == left or at_home):
            return None
        return robot, numbers if free == [*range(numbers.shape[1])] else numbers[:, free]

    def _posture(self, rows: np.ndarray) -> Posture:
        """The posture at some of the poses; of one pose it is found once."""
        if self._only is None or self.rows.shape:
            self._only = self.finder.at(self.request.part(rows), self.near)
        return self._only

    def direct_answer(self, rows: np.ndarray) -> Details:
        """The chosen form at N of the poses."""
        if rows.size > CHUNK:
            starts = range(0, rows.size, CHUNK)
            return Details.joined(
                [self.direct_answer(rows[start : start + CHUNK]) for start in starts]
            )
        posture = self._posture(rows)
        found = solve_snapshot(posture.snapshot, self.form, self.tolerance)
        reached = posture.reached
        status = (
            np.where(reached, found.status_codes, np.uint16(Status.UNREACHABLE))
            | (reached & ~posture.within_limits) * np.uint16(Status.BEYOND_LIMITS)
            | (reached & posture.undetermined) * np.uint16(Status.ILL_CONDITIONED)
        )
        legs = self.finder.robot.legs
        each = zip(legs, posture.coordinates, strict=True)
        return replace(
            found,
            status_codes=np.asarray(status, dtype=np.uint16),
            rank=np.where(reached, found.rank, -1),
            pose=posture.pose,
            joint_coordinates={leg.name: q for leg, q in each},
            joint_names={leg.name: leg.chain.coordinate_names for leg in legs},
        )

    def complaints(self, rows: np.ndarray, status: Status) -> tuple[str, ...]:
        """What is to be said of one pose of that status, or of several, beside their status."""
        found: tuple[str, ...] = ()
        flat = rows.reshape(-1)[:CHUNK]
        by_drives = self.request.by_drives
        if not rows.shape and status & _COMPLAINTS:
            posture = self._posture(flat)
            found = posture.complaints
            if self.request.is_whole and status & Status.UNREACHABLE:
                found = (*self.finder.free_coordinates_reach(posture, self.near), *found)
            if not by_drives and self.near is None and status & Status.UNREACHABLE:
                found = (*found, *self.finder.in_other_modes(posture))
        if self.near is not None or by_drives:
            return found
        if self.request.open and self.finder.coordinates_leave_drives_open:
            names = " ".join(own.value for own in self.finder.robot.coordinates)
            found = (
                *found,
                f"the free coordinates {names} leave a motion of the drives open away from home, "
                "which is singular: the posture nearest to home is taken; give all coordinates of "
                "the pose, or the model another home",
            )
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
        batch = found.batch_shape
        none = np.zeros((*batch, 0))
        super().__init__(machine.name, machine.space, method, tolerance, batch, none)
        self.machine, self._whole = machine, found
        self.asked: tuple[Any, ...] = (machine,)

    def direct_answer(self, rows: np.ndarray) -> Details:
        """What was found at N of the poses."""
        return self.details(self.rows)[np.unravel_index(rows, self.rows.shape)]

    def placed(self, row: np.ndarray) -> Snapshot | Network:
        """The machine itself, or one pose of a batch along one axis."""
        return self.machine.one(int(row)) if self.rows.shape else self.machine  # type: ignore[union-attr]


@singledispatch
def question_of(
    machine: Any, pose: Any, method: Form, near: Near, tolerance: Tolerance
) -> Question:
    """What arguments of `stiffness` ask; an InputError where they do not fit the machine."""
    del pose, method, near, tolerance
    raise InputError(
        "robot",
        got=machine,
        expected="a Robot, a Snapshot, a Network, a Linkage or a CableRobot",
        hint='write load("hexapod")',
    )


@question_of.register
def _(machine: Robot, pose: Any, method: Form, near: Near, tolerance: Tolerance) -> PosesOfRobot:
    machine.check_has_no_springs("stiffness without load")  # those need a load
    return PosesOfRobot(machine, pose, method, near, tolerance)


@question_of.register
def _(machine: Snapshot, pose: Any, method: Form, near: Near, tolerance: Tolerance) -> OwnPose:
    del near
    check_is_not_posed(machine, pose)
    machine.check_has_no_springs("stiffness without load")
    return OwnPose(machine, method, tolerance, solve_snapshot(machine, method, tolerance))


def function_for(function: Any, machine: Any) -> Callable[..., Any]:
    """A single-dispatch function for a machine.

    Those for linkages, networks and cables are imported with the first of them.
    """
    found = function.dispatch(type(machine))
    if found is function.dispatch(object):
        for module in ("linkage_stiffness", "cable_kernels"):
            import_module(f"robostiff.analysis.{module}")
        found = function.dispatch(type(machine))
    return found


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
    moving, not_given, by_joints = [], [], finder.robot.is_posed_by_joints
    for k, solver in enumerate(finder.solvers):
        if solver.has_redundant_drives:
            moving.append(repr(solver.leg.name))
        elif not (np.any(solver.leg.chain.home_given) if by_joints else solver.posture_is_given):
            not_given.append(k)
    each = (_in_several(posture, finder, not_given, row, tolerance) for row in rows.tolist())
    names = [repr(finder.solvers[k].leg.name) for k in sorted({k for own in each for k in own})]
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


def _in_several(
    posture: Posture, finder: PostureFinder, numbers: Sequence[int], row: int, tolerance: Tolerance
) -> Iterator[int]:
    """Those of some legs that reach a pose in several postures of different stiffness."""
    legs: dict[int, dict[int, PlacedLeg]] = defaultdict(dict)  # by how many others they have
    for k in numbers:
        leg, others = finder.solvers[k].leg, finder.solvers[k].alternatives(posture.pose[row])
        if len(others):
            every = np.concatenate([posture.coordinates[k][[row]], others])
            placed = place_chain(leg.chain, every, leg.base.R, leg.base.p)
            legs[len(others)][k] = PlacedLeg(leg.name, placed.elements, placed.p)
    space, reference = finder.robot.space, posture.snapshot.reference_point[row]
    s = scaling(np.array(finder.length), space)
    for count, alike in legs.items():
        at = np.broadcast_to(reference, (count + 1, 3))
        snapshot = Snapshot(finder.robot.name, tuple(alike.values()), at, space)
        solved = solve_snapshot(snapshot, DEFAULT_METHOD, tolerance).legs
        for k, leg in zip(alike, solved, strict=True):
            K = leg.matrix / np.outer(s, s)
            if np.any(np.abs(K[1:] - K[0]) > _SAME * np.max(np.abs(K[0]))):
                yield k
