"""The record of a machine, kept with it: made once it pays, and asked for many poses or for one."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.analysis.questions import PosesOfRobot, Question, dispatched
from robostiff.errors import InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import posture_finder
from robostiff.kinematics.pose import PoseRequest
from robostiff.model import Robot
from robostiff.model.checks import FARTHEST, FULL_TURN

# Of a record, numbers and trials of working frames among them: some two seconds, and an arm of a
# hundred joints. Beyond, the direct form stays.
_MOST_OPERATIONS = 100_000
# One that is on disk is read in as long as one or two calls take, and loading what reads it takes
# some more: who asks once has an answer before.
_READER, _CALLS = "robostiff.analysis.compiled_stiffness", 2


@dataclass
class KeptRecord:
    """The record of one machine: read from disk, or made once it pays; run by NumPy at first.

    It pays once as many poses were computed without it as `Question.pays` says.
    """

    machine: Any
    calls: int = 0
    poses: int = 0  # computed without the record, or by NumPy
    compiled: Any = None
    is_sought: bool = False  # on disk
    is_tried: bool = False
    is_machine_code: bool = False

    def for_poses(self, count: int, pays: tuple[int, int, int]) -> Any:
        """What computes that many poses; None where it does not pay yet, or there is no record."""
        a_call, recording, machine_code = pays
        self.poses += a_call + count
        if self.compiled is None:
            if not self.is_tried:
                self._seek(self.poses >= recording)
        elif self.poses > machine_code and not self.is_machine_code:
            from robostiff.compiled import MachineCode, machine_code_is_available

            self.is_machine_code = True
            if machine_code_is_available():
                kernel = self.compiled.kernel.by(MachineCode)
                self.compiled = replace(self.compiled, kernel=kernel)
        return self.compiled

    def _seek(self, pays: bool) -> None:
        self.calls += 1
        is_near = _READER in sys.modules or self.calls >= _CALLS
        if not pays and (self.is_sought or not is_near):
            return
        from robostiff.analysis.compiled_stiffness import CompiledStiffness
        from robostiff.analysis.kernel_inputs import recordable
        from robostiff.compiled import Backend

        self.is_sought = True
        with suppress(InputError, NoAnswerError):
            taken = dispatched(recordable, self.machine)(self.machine, (), None)
            most = _MOST_OPERATIONS if pays else 0
            made = CompiledStiffness.of(taken, backend=Backend.ARRAYS, most=most)
            self.compiled, self.poses = (made, 0) if made.verified else (None, self.poses)
        self.is_tried = pays


@kept
def record_of(machine: Any) -> KeptRecord:
    """The record of a robot or of a driven linkage, kept with it."""
    return KeptRecord(machine)


def ask_record(question: Question) -> None:
    """Have a question answered by the record of its machine, where there is one and it pays."""
    given = question.recordable()
    if given is not None:
        machine, poses = given
        compiled = record_of(machine).for_poses(question.rows.size, question.pays)
        if compiled is not None:
            question.recorded = compiled.evaluate(poses).reshaped(question.rows.shape)


def recorded_at_one(robot: Robot, pose: Any) -> PosesOfRobot | None:
    """One pose of free coordinates in plain numbers, answered by the record of the robot.

    None of other poses, and where the record does not answer at once: for `stiffness`, which then
    reads and answers the pose as any other.
    """
    record = record_of(robot)
    if record.compiled is None:
        return None
    places, home, left = _plain_coordinates(robot)
    numbers = pose.tolist() if type(pose) is np.ndarray and pose.ndim == 1 else pose
    if type(numbers) is not list or len(numbers) != len(places):
        return None
    coordinates, turned = home.copy(), 0.0
    for place, x in zip(places, numbers, strict=True):
        is_number = type(x) is float or type(x) is int
        if not is_number or (place < 3 and not abs(x - home[place]) <= FARTHEST):
            return None
        coordinates[place] = x
        turned += x * x if place >= 3 else 0.0
    found = None
    if turned <= FULL_TURN**2:
        found = record.for_poses(1, PosesOfRobot.pays).at_one(numbers)
    if found is None:
        return None
    question = PosesOfRobot(robot, PoseRequest((), np.array([coordinates]), left))
    question.recorded = found
    return question


@kept
def _plain_coordinates(robot: Robot) -> tuple[list[int], list[float], tuple[int, ...]]:
    """Places of free pose coordinates among all six, those of home, and what the legs decide.

    Of an arm there are no places.
    """
    places = robot.coordinate_places if not robot.is_serial else ()
    inside = list(places) if all(place in robot.space.rows for place in places) else []
    left = tuple(place for place in robot.space.rows if place not in inside)
    return inside, posture_finder(robot).home_pose.tolist(), left
