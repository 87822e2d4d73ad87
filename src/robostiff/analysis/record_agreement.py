"""Whether a record tells what the wrench basis form tells, before it is trusted."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.kernel_inputs import KernelInputs
from robostiff.analysis.parameter_values import ParameterValues
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import stiffness
from robostiff.compiled import ArrayCode
from robostiff.elastostatics import Status, Tolerance
from robostiff.elastostatics.tolerance import scaling
from robostiff.kinematics import JointCoordinates, PostureFinder
from robostiff.record import Program
from robostiff.recorded import RecordedRobot, parameter_samples, sample_postures

# Generic poses must keep away from the tolerances that decide, by what poses may differ.
_STRICT = Tolerance(near_independence=1e-4, near_rigidity=1e-8)
_AGREEMENT = 1e-9
_FREE = 1e-6  # of the largest size: what rounding leaves of zero
_OTHER_SEED = 47


def agrees(recorded: RecordedRobot, inputs: KernelInputs, finder: PostureFinder) -> bool:
    """Whether record and wrench basis form give the same K, rank and status at generic poses.

    Once at the poses at which it was recorded, and once at others: what a record takes for zero or
    for the same at its own samples must be so elsewhere.
    """
    robot = inputs.robot
    program = Program.of(recorded.record, list(recorded.K.values()))
    by_joints = robot.is_posed_by_joints
    told = robot.coordinate_places
    for seed in (None, _OTHER_SEED):
        posture = sample_postures(finder.robot, finder, seed)
        values = ParameterValues(robot, np.array(list(parameter_samples(robot, seed).values())))
        given = posture.coordinates[0] if by_joints else posture.pose[:, told]
        pose = JointCoordinates(given) if by_joints else given
        kernel_rows = inputs.rows(pose, given, values)
        K = np.empty((len(program.outputs), kernel_rows.rows.shape[1]))
        ArrayCode(program).evaluate(kernel_rows.rows, K)
        for other, own in values.groups(~kernel_rows.missed):
            part = JointCoordinates(given[own]) if by_joints else given[own]
            result = stiffness(other, part, tolerance=_STRICT)
            if not _agree_at(recorded, K[:, own], result):
                return False
    return True


def _agree_at(recorded: RecordedRobot, K_rows: np.ndarray, result: RobotStiffness) -> bool:
    """Whether rows of K and the answer of the wrench basis form are the same, within rounding."""
    reached = (result.status_codes & int(Status.UNREACHABLE)) == 0
    result, K_rows = result[reached], K_rows[:, reached]
    if np.any(result.rank != recorded.factors.rank):
        return False
    if np.any(result.status_codes & ~np.uint8(Status.BEYOND_LIMITS) != int(recorded.status)):
        return False
    size = _sizes(result, recorded.length)
    return all(
        np.all(np.abs(own - result.K[:, i, j]) <= _AGREEMENT * size[:, i] * size[:, j])
        for own, (i, j) in zip(K_rows, recorded.K, strict=True)
    )


def _sizes(result: RobotStiffness, length: float) -> np.ndarray:
    """Sizes by which the entries of K are judged, sqrt(K_ii), those of free motions not zero."""
    scale = scaling(np.array(length), result.space)
    size = np.sqrt(np.einsum("...ii->...i", result.K)) / scale
    return np.maximum(size, _FREE * size.max(axis=-1, keepdims=True)) * scale
