"""Cable robots compiled: poses as inputs of a record, which the direct form confirms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness, cable_stiffness
from robostiff.analysis.compiled_answer import AtGeneralPoses, InputRows, answer_of_kernel
from robostiff.analysis.kernel_inputs import (
    ParameterValues,
    Recordable,
    RecordedParts,
    numbers_of_poses,
    recordable,
)
from robostiff.analysis.questions import distances
from robostiff.analysis.recording import recorded_parts
from robostiff.cables import record_cables
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    DisplacementUnder,
    EntryOf,
    Output,
    Rates,
    StiffnessMatrix,
    kernel_of,
)
from robostiff.elastostatics import Status
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import DisagreementError, InputError, NoAnswerError, Words
from robostiff.frozen import frozen
from robostiff.kinematics.pose import requested_pose
from robostiff.model.cable import CableRobot

_SAMPLES = 5
_DRAWN = 200
_SHRINKS = 6
_SPREAD = 0.1  # of the size of the robot, and radians
_AGREEMENT = 1e-9


@frozen
class CableInputs(Recordable):
    """A cable robot, and rows that its kernel takes: free coordinates of the platform."""

    subject: CableRobot

    def numbers_of(self, pose: Any) -> np.ndarray:
        """The numbers of poses (N, n), or of one pose (n,)."""
        return numbers_of_poses(self.subject, pose)

    def rows(self, pose: Any, given: np.ndarray, values: ParameterValues[Any]) -> InputRows:
        """Rows of inputs: no pose is known to be out of reach."""
        del pose, values
        none = np.zeros(len(given), dtype=bool)
        return InputRows(given.T, none, none)

    def direct(self, machine: Any, pose: Any, given: np.ndarray) -> CableStiffness:
        """The stiffness at some coordinates, by the direct form."""
        del pose
        return cable_stiffness(machine, given)

    def samples(self, seed: int, nearer: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Poses near home at which the robot is stable, and no parameters."""
        robot, random = self.subject, np.random.default_rng(seed)
        home = self.home[robot.coordinate_places]
        size = float(cable_stiffness(robot).characteristic_length)
        scale = np.array([size if c.unit == "m" else 1.0 for c in robot.coordinates])
        for k in range(nearer, _SHRINKS):
            drawn = random.uniform(-1.0, 1.0, (_DRAWN, len(home))) * scale * _SPREAD * 0.2**k
            found = cable_stiffness(robot, home + drawn)
            good = found.answered & (found.rank == len(home))
            good &= (found.status_codes & int(Status.UNSTABLE | Status.ILL_CONDITIONED)) == 0
            rows = np.flatnonzero(good)[:_SAMPLES]
            if rows.size == _SAMPLES:
                return home + drawn[rows], {}
        raise NoAnswerError(
            f"no record of {robot.name!r}: around home it has no poses with tensions within their "
            "limits at which it is stable and held in all directions"
        )

    @property
    def home(self) -> np.ndarray:
        """All coordinates of the home pose (6,)."""
        return requested_pose(cast(Any, self.subject), None).coordinates.reshape(6)


@recordable.register
def _(robot: CableRobot, parameters: Sequence[str], joints: Sequence[str] | None) -> CableInputs:
    for what, given in (("parameters", parameters), ("driven joints", joints)):
        if given:
            expected = "none: a cable robot has numbers alone, and takes poses"
            raise InputError(f"{what} of {robot.name!r}", got=given, expected=expected)
    return CableInputs(robot)


@recorded_parts.register
def _(
    taken: CableInputs, outputs: tuple[Output, ...], backend: Backend, most: int | None
) -> RecordedParts:
    del most
    robot = taken.subject
    for output in outputs:
        inner = output
        while isinstance(inner, EntryOf | Rates):
            inner = inner.of
        if isinstance(inner, DeflectionUnder | DisplacementUnder):
            raise InputError(
                f"output to compile of {robot.name!r}",
                got=Words(f"{inner.name} of a cable robot"),
                expected="K, compliance, principal stiffnesses, worst deflection or tensions",
                hint="cable_response(robot, pose, wrench=...) finds which cables become slack",
            )
    m, n = len(robot.cables), robot.space.size
    if m < n and robot.given_tensions is None:
        raise NoAnswerError(
            f"no record of {robot.name!r}: {m} cables balance its weight at single poses alone, "
            f"and {n} or more at all poses around home; write stiffness(robot, poses)"
        )
    recorded = record_cables(robot, taken.samples(0, 0)[0], taken.home)
    # Confirmed once at the poses at which it was recorded, and once at others.
    of_matrix = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    general, trusted = AtGeneralPoses(n, Status.OK, verified=True), True
    for seed in (0, 1):
        poses = taken.samples(seed, 0)[0]
        rows = taken.rows(poses, poses, cast(Any, None))
        answer, direct = (
            answer_of_kernel(of_matrix, rows, general, 1),
            cable_stiffness(robot, poses),
        )
        own = ~answer.guarded
        scale = scaling(direct.characteristic_length, robot.space)
        apart = distances(answer.matrix, direct.matrix, scale, 0.0)
        apart[(answer.status_codes != direct.status_codes) | (answer.rank != direct.rank)] = np.inf
        for i in np.flatnonzero(own & ~(apart <= _AGREEMENT)).tolist():
            place = f"{robot.name!r} at {poses[i].tolist()}"
            raise DisagreementError("the record and the direct form", float(apart[i]), place)
        trusted &= bool(own.any())
    kernel = kernel_of(recorded, outputs, backend)
    return n, Status.OK, trusted, kernel, None, None
