"""Every way from a robot and its poses to stiffness: batches, kernels, formulas, files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import robostiff as rs
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import InputError, NoAnswerError
from robostiff.kinematics import Pose
from robostiff.kinematics.posture_finder import posture_finder
from robostiff.robots import robot_file
from tests.campaign import ways
from tests.campaign.answers import Complaint, Judge
from tests.campaign.formulas import formula
from tests.campaign.parameters import kernel_with_parameters, map_of_blocks
from tests.campaign.posed import Posed
from tests.campaign.reference import _extent
from tests.campaign.reread import placed, turned
from tests.campaign.reread_answers import SHIPPED, Reread, distance, is_right
from tests.campaign.reread_machine import Machine, NotClosedError
from tests.campaign.rounded import rounded_poses
from tests.campaign.single_leg import is_free

_DECISIVE = ~int(Status.ILL_CONDITIONED)
# Poses at which recording a robot pays.
_RECORDED = 6000


class Case:
    """A robot, its poses, and what the batch of all of them says."""

    def __init__(self, posed: Posed, rng: np.random.Generator) -> None:
        self.posed, self.robot, self.rng = posed, posed.robot, rng
        self.complaints: list[Complaint] = []
        self.batch = direct_stiffness(self.robot, posed.pose())
        self.finder = posture_finder(self.robot)
        self.posture = self.finder.find(posed.pose())
        self.size = _extent(self.posture.snapshot.one(0))

    def say(self, way: str, what: str, detail: str) -> None:
        self.complaints.append(Complaint(way, what, detail[:400]))

    @cached_property
    def again(self) -> Reread | None:
        """The robot, or its model file, in parts of ours; None where home alone has a posture."""
        posed, robot = self.posed, self.robot
        if posed.shipped:
            own = Machine(robot_file(posed.shipped), dict(posed.parameters), shipped=SHIPPED)
        elif robot.home is not None and not robot.coordinates:
            return None
        elif posed.text:
            own = Machine("random.yaml", text=posed.text)
        else:
            own = Machine("robot", text="{}", robot=robot)
        return Reread(robot, own)

    def good(self) -> np.ndarray:
        """Rows with a matrix that is not in doubt."""
        doubt = self.batch.status_codes & int(Status.ILL_CONDITIONED)
        return np.flatnonzero(self.batch.answered & (doubt == 0))

    def free_coordinates(self) -> Pose:
        """The poses as kernels take them: a structure without free coordinates has one alone."""
        posed = self.posed
        is_fixed = not self.robot.coordinates and not posed.by_joints
        return np.zeros((len(posed.rows), 0)) if is_fixed else posed.pose()

    def K(self, row: int) -> np.ndarray:
        return self.batch[row].K

    def off(self, K: np.ndarray, other: np.ndarray) -> float:
        return Judge(None, self.size, True).distance(K, other)

    def same(self, way: str, row: int, K: np.ndarray | None, status: int, rank: int) -> None:
        """Compare an answer with that of the batch."""
        own = int(self.batch.status_codes[row])
        doubt = (own | status) & int(Status.ILL_CONDITIONED)
        at = f"row {row}"
        if (own ^ status) & _DECISIVE or rank != int(self.batch.rank[row]):
            if not doubt:
                words = (
                    f"{Status(status)}, rank {rank} for {Status(own)}, rank {self.batch.rank[row]}"
                )
                self.say(
                    way, f"another status ({Status((own ^ status) & _DECISIVE)})", f"{at}: {words}"
                )
            return
        if doubt or K is None or not self.batch.answered[row] or rank == 0:
            return
        off = self.off(K, self.K(row))
        if not off <= 2e-9:
            self.say(way, "another K than in the batch", f"{at}: {off:.2e}; {Status(own)}")


def _alone(case: Case) -> None:
    row = int(case.rng.integers(len(case.posed.rows)))
    one = rs.stiffness(case.robot, case.posed.pose(row))
    case.same("alone", row, one.K if bool(one.answered) else None, int(one.status), int(one.rank))


def _many(case: Case) -> None:
    """So many poses that the robot is recorded."""
    count = len(case.posed.rows)
    rows = np.tile(case.posed.rows, (-(-_RECORDED // count), 1))
    found = rs.stiffness(case.robot, case.posed.pose(rows))
    for row in range(count):
        one = found[row]
        K = one.K if bool(one.answered) else None
        case.same("many poses", row, K, int(one.status), int(one.rank))


def _bad_poses(case: Case) -> None:
    """The same row beside poses out of reach, and home."""
    row = int(case.rng.integers(len(case.posed.rows)))
    mine = case.posed.rows[row]
    far = mine + 1e3 if not case.posed.by_joints else np.zeros_like(mine)
    rows = np.vstack([far, mine, case.posed.rows[0], np.zeros_like(mine)])
    found = rs.stiffness(case.robot, case.posed.pose(rows))[1]
    K = found.K if bool(found.answered) else None
    case.same("bad poses beside", row, K, int(found.status), int(found.rank))


def _kernel(backend: rs.Backend, name: str) -> Callable[[Case], None]:
    def ask(case: Case) -> None:
        if not np.any(case.good()):
            return
        try:
            compiled = rs.compile(case.robot, backend=backend)
        except InputError as error:
            if any(w in str(error) for w in ("rigid", "room around", "generic", "no place")):
                return  # refused with words
            raise
        if not compiled.verified and not _near_a_limit(case):
            case.say(name, "not verified, and no pose is near a limit", "verified is False")
        found = compiled.evaluate(case.free_coordinates())
        for row in range(len(case.posed.rows)):
            status, rank = int(found.status_codes[row]), int(found.rank[row])
            case.same(name, row, found.values["K"][row], status, rank)

    return ask


def _near_a_limit(case: Case) -> bool:
    """Whether a pose is so near what decides that poses beside it may have another status.

    A kernel whose generic poses are so leaves them to the batched form, and says not verified; a
    difference at a pose that is not in doubt is raised by `compile` itself. Recorded steps of a
    closure do not arrive near singularities of a leg.
    """
    if case.posed.q is not None and any(is_free(case.robot, q) for q in case.posed.q):
        return True
    strict = Tolerance(near_independence=1e-4, near_rigidity=1e-8)
    codes = rs.stiffness(case.robot, case.posed.pose(), tolerance=strict).status_codes
    return bool(np.any(codes & int(Status.ILL_CONDITIONED)))


def _kernel_compliance(case: Case) -> None:
    """Compliance by a kernel, singular poses among the others."""
    n = case.robot.space.size
    if int(np.max(case.batch.rank)) < n:
        return
    try:
        compiled = rs.compile(case.robot, [rs.ComplianceMatrix()], backend=rs.Backend.ARRAYS)
    except (InputError, NoAnswerError):
        return
    found = compiled.evaluate(case.free_coordinates())
    (C,) = found.values.values()
    for row in case.good():
        if int(case.batch.rank[row]) == n and case.batch.status_codes[row] == 0:
            off = case.off(C[row] @ case.K(row), np.eye(n)) if np.isfinite(C[row]).all() else np.inf
            if not off <= 1e-6:
                case.say("kernel of the compliance", "no inverse of K", f"row {row}: {off:.2e}")


def _reread(case: Case) -> None:
    """Where small steps lead from home, and how stiff it is there, by the model file alone."""
    again, rows = case.again, case.posed.rows
    if again is None or len(rows) < 2:
        return
    row = 1 + int(case.rng.integers(len(rows) - 1))
    try:
        found = again.at(rows[row])
    except NotClosedError:
        _back(case, again, row)
        return
    if "unreachable" in found["status"]:
        if not again.by_joints and again.is_smooth(rows[row]):
            case.say("reread", "unreachable, and there is a way from home", f"row {row}")
    elif case.batch.answered[row] and not is_right(found, 1e-6):
        case.say("reread", "another answer than in the assembly mode of home", f"{row}: {found}")


def _back(case: Case, again: Reread, row: int) -> None:
    """From the posture that is reported to home: there it must be that of home."""
    if not case.posture.reached[row] or case.robot.is_coupled:
        return
    T = placed(turned(case.posture.pose[row, 3:]), case.posture.pose[row, :3])
    q = again.joints_of([own[row] for own in case.posture.coordinates])
    wanted = dict(zip(again.names, again.home, strict=True))
    try:
        q, P = again.own.posture(q, wanted, start=T)
    except NotClosedError:
        return
    home = rs.stiffness(case.robot)
    if home.status & (Status.ILL_CONDITIONED | Status.REDUNDANT_JOINTS | Status.RIGID_DIRECTION):
        return
    truth = again.own.stiffness(q, P)
    if truth and (off := distance(home.K, truth.K, again.size)) > 1e-6:
        detail = f"row {row}: back at home K is {off:.1e} off"
        case.say("reread", "stands in another assembly mode than home", detail)


def _frozen(case: Case) -> None:
    """The posture as a snapshot, through the ways of snapshots, with the reference."""
    rows = np.flatnonzero(case.posture.reached)
    if not rows.size:
        return
    row = int(rows[case.rng.integers(rows.size)])
    snapshot = case.posture.snapshot.one(row)
    seed = [int(x) for x in case.rng.integers(2**31, size=2)]
    judge, _ = ways.judged(snapshot, seed)
    for complaint in judge.complaints:
        case.say(f"frozen, {complaint.way}", complaint.what, f"row {row}: {complaint.detail}")
    one = rs.stiffness(snapshot)
    status = int(one.status) | int(case.batch.status_codes[row]) & int(Status.BEYOND_LIMITS)
    K = one.K if bool(one.answered) else None
    case.same("frozen", row, K, status, int(one.rank))


@dataclass(frozen=True)
class PosedWay:
    """A way, and which share of robots takes it."""

    name: str
    ask: Callable[[Case], None]
    every: int


WAYS = (
    PosedWay("alone", _alone, 1),
    PosedWay("bad poses beside", _bad_poses, 4),
    PosedWay("many poses", _many, 24),
    PosedWay("reread", _reread, 2),
    PosedWay("frozen", _frozen, 3),
    PosedWay("kernel", _kernel(rs.Backend.BEST, "kernel"), 16),
    PosedWay("kernel in NumPy", _kernel(rs.Backend.ARRAYS, "kernel in NumPy"), 24),
    PosedWay("kernel of the compliance", _kernel_compliance, 24),
    PosedWay("kernel with parameters", kernel_with_parameters, 6),
    PosedWay("map", map_of_blocks, 24),
    PosedWay("formula in steps", formula(False), 30),
    PosedWay("formula at home", formula(True), 80),
    PosedWay("rounded", rounded_poses, 3),
)


def judged_posed(posed: Posed, seed: list[int]) -> list[Complaint]:
    """A robot and its poses through a share of the ways."""
    try:
        case = Case(posed, np.random.default_rng(seed))
    except Exception as error:  # whatever is raised is a finding
        text = f"{type(error).__name__}: {error}"
        return [Complaint("batch of poses", f"raised {type(error).__name__}", text[:300])]
    for i, way in enumerate(WAYS):
        rng = np.random.default_rng([*seed, i])
        if rng.integers(way.every):
            continue
        case.rng = rng
        try:
            way.ask(case)
        except Exception as error:
            case.say(way.name, f"raised {type(error).__name__}", str(error))
    return case.complaints
