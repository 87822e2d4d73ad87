"""The record of a robot, kept with it: made once it pays, and asked for many poses or for one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.analysis.careful_form import AskedPoses
from robostiff.analysis.snapshot_stiffness import DEFAULT_METHOD
from robostiff.elastostatics import DEFAULT_TOLERANCE
from robostiff.errors import InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates
from robostiff.kinematics.solved_request import SolvedRequest
from robostiff.model import Robot

if TYPE_CHECKING:
    from robostiff.analysis.compiled_answer import CompiledAnswer
    from robostiff.analysis.compiled_linkage import CompiledLinkage
    from robostiff.analysis.compiled_robot import CompiledRobot

# Recording takes as long as the careful form at some 6,000 poses of a batch, or in 20 to 30 calls
# (all shipped robots: 3,000 to 9,000 poses, 10 to 30 calls). It begins when as much was spent.
_A_CALL = 250  # poses of a batch, which take as long as what a call begins with
_PAYS = 6_000
# Of a record, numbers and trials of working frames among them: some two seconds, and an arm of a
# hundred joints. Beyond, the careful form stays.
_MOST_OPERATIONS = 100_000
# Machine code is some 0.5 us a pose faster than NumPy, and takes 0.1 s to compile after 0.5 s to
# load the compiler: below a million poses NumPy is done before.
_MACHINE_CODE_PAYS = 2**20


@dataclass(frozen=True)
class RecordedAnswer:
    """Stiffness matrices about the reference point, status and rank at poses."""

    K: np.ndarray  # (..., n, n): meaningful where the status says that there is one
    status_codes: np.ndarray  # (...) of uint16
    rank: np.ndarray  # (...) of int8

    @classmethod
    def of(cls, answer: CompiledAnswer) -> RecordedAnswer:
        """What a kernel of K gives."""
        from robostiff.compiled import StiffnessMatrix

        return cls(answer.values[StiffnessMatrix.name], answer.status_codes, answer.rank)

    def reshaped(self, batch: tuple[int, ...]) -> RecordedAnswer:
        """The same under another batch shape."""
        return RecordedAnswer(
            self.K.reshape(*batch, *self.K.shape[-2:]),
            self.status_codes.reshape(batch),
            self.rank.reshape(batch),
        )

    def __getitem__(self, index: Any) -> RecordedAnswer:
        return RecordedAnswer(
            self.K[index], np.asarray(self.status_codes[index]), np.asarray(self.rank[index])
        )


@dataclass(frozen=True)
class Costs:
    """When a record pays, in poses of a batch as they are computed without it."""

    a_call: int  # what each call begins with
    pays: int  # what recording takes
    machine_code_pays: int  # how many poses a record serves on NumPy before it is compiled


class KeptRecord:
    """The record of one robot or linkage, which `make` compiles on NumPy once it pays."""

    def __init__(
        self, make: Callable[[], CompiledRobot | CompiledLinkage | None], costs: Costs
    ) -> None:
        self._make, self._costs = make, costs
        self._asked = self._served = 0
        self._compiled: Any = None
        self._is_tried = self._is_machine_code = False

    def for_poses(self, count: int) -> Any:
        """What computes that many poses; None where it does not pay yet, or there is no record."""
        if not self._is_tried:
            self._asked += self._costs.a_call + count
            if self._asked < self._costs.pays:
                return None
            with suppress(InputError, NoAnswerError):
                made = self._make()
                self._compiled = made if made is not None and made.verified else None
            self._is_tried = True
        compiled = self._compiled
        if compiled is None:
            return None
        from robostiff.compiled import machine_code_is_available

        self._served += count
        pays = self._served > self._costs.machine_code_pays
        if pays and not self._is_machine_code and machine_code_is_available():
            self._is_machine_code = True
            kernel = compiled.kernel.in_machine_code()
            compiled = self._compiled = replace(compiled, kernel=kernel)
        return compiled


def recorded_answer(robot: Robot, asked: AskedPoses) -> RecordedAnswer | None:
    """What the record of a robot says of poses; None where the careful form is to be used.

    That is so for other methods, tolerances and postures than a record has, for robots that have
    none, and until a record pays.
    """
    given = _inputs(robot, asked)
    if given is None or not given.size:  # no poses, or a structure that has one alone
        return None
    compiled = record_of(robot).for_poses(len(given))
    if compiled is None:
        return None
    answer = RecordedAnswer.of(
        compiled.evaluate(JointCoordinates(given) if robot.is_posed_by_joints else given)
    )
    return answer if len(asked.batch) == 1 else answer.reshaped(asked.batch)


@kept
def record_of(robot: Robot) -> KeptRecord:
    """The record of a robot, made once it pays."""
    return KeptRecord(partial(_compiled, robot), Costs(_A_CALL, _PAYS, _MACHINE_CODE_PAYS))


def _inputs(robot: Robot, asked: AskedPoses) -> np.ndarray | None:
    """Free coordinates of poses (N, n), where they are asked for as a record gives them."""
    if (
        asked.near is not None
        or isinstance(asked.request, SolvedRequest)
        or asked.method != DEFAULT_METHOD
        or asked.tolerance != DEFAULT_TOLERANCE
    ):
        return None
    request, numbers = asked.request, asked.numbers
    if isinstance(request, np.ndarray):
        return numbers if robot.is_posed_by_joints else None
    if robot.is_posed_by_joints:
        return None
    free = [place for place in robot.coordinate_places if place in robot.space.rows]
    left = tuple(place for place in robot.space.rows if place not in free)
    # Where the legs decide the others, those of home are right at home alone.
    at_home = not request.batch and np.array_equal(numbers[0], asked.finder.home_pose)
    if not free or not (request.open == left or at_home):
        return None
    return numbers if free == list(range(numbers.shape[1])) else numbers[:, free]


def _compiled(robot: Robot) -> CompiledRobot:
    """The robot's kernel on NumPy.

    Raises NoAnswerError where its record would be longer than what it can ever pay for.
    """
    from robostiff.analysis.compiled_robot import recorded_and_compiled
    from robostiff.compiled import Backend, StiffnessMatrix

    return recorded_and_compiled(
        robot.numeric, (StiffnessMatrix(),), (), Backend.ARRAYS, _MOST_OPERATIONS
    )
