"""The record of a machine, kept with it: made once it pays, and asked for many poses or for one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.questions import PosesOfRobot, Question
from robostiff.errors import InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, posture_finder
from robostiff.kinematics.pose import PoseRequest
from robostiff.model import Robot
from robostiff.model.checks import FARTHEST, FULL_TURN

if TYPE_CHECKING:
    from robostiff.analysis.answer_of_kernel import CompiledAnswer
    from robostiff.analysis.compiled_stiffness import CompiledStiffness
    from robostiff.linkage import DrivenLinkage

# Recording a robot takes as long as the direct form at some 6,000 poses of a batch, or in 20 to 30
# calls (all shipped robots: 3,000 to 9,000 poses, 10 to 30 calls). It begins when that was spent.
_A_CALL = 250  # poses of a batch, which take as long as what a call begins with
_PAYS = 6_000
# Of a record, numbers and trials of working frames among them: some two seconds, and an arm of a
# hundred joints. Beyond, the direct form stays.
_MOST_OPERATIONS = 100_000
# Machine code is some 0.5 us a pose faster than NumPy, and takes 0.1 s to compile after 0.5 s to
# load the compiler: below a million poses NumPy is done before. A call counts as `_A_CALL` poses.
_MACHINE_CODE_PAYS = 2**20
# Of a linkage: some 340 configurations of a batch, or 20 calls (double pantograph), and 10^5 poses.
_OF_LINKAGES = 17, 340, 2**17
_READER = "robostiff.analysis.compiled_stiffness"


@dataclass
class KeptRecord:
    """The record of one robot or linkage, which `make` compiles on NumPy once it pays.

    It pays once as many poses were computed without it. Before that, a record that an earlier
    program left on disk is read, if the module that reads it is loaded anyway; `make` takes whether
    it may record, too.
    """

    make: Callable[[bool], CompiledStiffness | None]
    a_call: int  # poses that take as long as what each call begins with
    pays: int  # and as recording
    machine_code_pays: int  # how many poses it serves on NumPy before it is compiled
    asked: int = 0
    served: int = 0
    compiled: Any = None
    is_sought: bool = False  # on disk
    is_tried: bool = False
    is_machine_code: bool = False

    def answer(self, poses: JointCoordinates | np.ndarray) -> CompiledAnswer | None:
        """K, rank and status at N poses; None where it does not pay yet, or there is no record."""
        by_joints = isinstance(poses, JointCoordinates)
        compiled = self.for_poses(len(np.asarray(poses.values if by_joints else poses)))
        return None if compiled is None else compiled.evaluate(poses)

    def answer_at_one(self, inputs: np.ndarray) -> CompiledAnswer | None:
        """K, rank and status at inputs (n,) of a kernel; None where the kernel does not answer."""
        compiled = self.for_poses(1)
        kernel = compiled.kernel
        return compiled.at_one(kernel, inputs) if len(kernel.inputs) == len(inputs) else None

    def for_poses(self, count: int) -> Any:
        """What computes that many poses; None where it does not pay yet, or there is no record."""
        if not self.is_tried:
            self.asked += self.a_call + count
            pays = self.asked >= self.pays
            if not pays and (self.is_sought or _READER not in sys.modules):
                return None
            self.is_sought = True
            with suppress(InputError, NoAnswerError):
                made = self.make(pays)
                self.compiled = made if made is not None and made.verified else None
            self.is_tried = pays or self.compiled is not None
        if self.compiled is None:
            return None
        from robostiff.compiled import MachineCode, machine_code_is_available

        self.served += self.a_call + count
        pays = self.served > self.machine_code_pays
        if pays and not self.is_machine_code and machine_code_is_available():
            self.is_machine_code = True
            self.compiled = replace(self.compiled, kernel=self.compiled.kernel.by(MachineCode))
        return self.compiled


@kept
def record_of(subject: Any) -> KeptRecord:
    """The record of a robot or of a driven linkage, made once it pays."""
    return KeptRecord(partial(_compiled, subject), *_costs()[subject.kind])


def _costs() -> dict[str, tuple[int, int, int]]:
    return {"robot": (_A_CALL, _PAYS, _MACHINE_CODE_PAYS), "linkage": _OF_LINKAGES}


def _compiled(subject: Any, may_record: bool) -> CompiledStiffness | None:
    """The kernel of K of a robot or driven linkage on NumPy.

    A robot is looked for on disk even where it is not recorded yet. Raises NoAnswerError where its
    record would be longer than what it can ever pay for.
    """
    from robostiff.analysis.compiled_stiffness import compile_linkage, compile_robot
    from robostiff.compiled import Backend, StiffnessMatrix

    def of_robot(robot: Robot) -> CompiledStiffness:
        most = _MOST_OPERATIONS if may_record else 0
        return compile_robot(robot.numeric, (StiffnessMatrix(),), (), Backend.ARRAYS, most)

    def of_linkage(driven: DrivenLinkage) -> CompiledStiffness | None:
        has_record = may_record and driven.drives and driven.home.is_closed
        return compile_linkage(driven, backend=Backend.ARRAYS) if has_record else None

    kinds: dict[str, Callable[[Any], Any]] = {"robot": of_robot, "linkage": of_linkage}
    return kinds[subject.kind](subject)


def ask_record(question: Question) -> None:
    """Have a question answered by the record of its machine, where there is one and it pays."""
    given = question.recordable()
    if given is not None:
        subject, inputs = given
        answer = record_of(subject).answer(inputs)
        question.recorded = None if answer is None else answer.reshaped(question.rows.shape)


def recorded_at_one(robot: Robot, pose: Any) -> PosesOfRobot | None:
    """One pose of free coordinates in plain numbers, answered by the record of the robot.

    None of other poses, and where the record does not answer at once: for `stiffness`, which then
    reads and answers the pose as any other.
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
    question = PosesOfRobot(robot, PoseRequest((), coordinates[None], left))
    question.recorded = found
    return question


@kept
def _plain_coordinates(robot: Robot) -> tuple[list[int], np.ndarray]:
    """Places of free pose coordinates among all six, and those of home; of an arm no places."""
    places = robot.coordinate_places if not robot.is_serial else ()
    inside = all(place in robot.space.rows for place in places)
    return list(places) if inside else [], posture_finder(robot).home_pose
