"""Comparison of a record with the wrench basis form, before it is used."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.guarded_values import AtGeneralPoses, checked_results, closes
from robostiff.analysis.kernel_inputs import KernelInputs, ParameterValues
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import Backend, StiffnessMatrix, kernel_of, unpack
from robostiff.elastostatics import Status, Tolerance
from robostiff.elastostatics.tolerance import scaling
from robostiff.errors import DisagreementError
from robostiff.kinematics import JointCoordinates, PostureFinder
from robostiff.model import Robot
from robostiff.recorded import RecordedRobot, parameter_samples, sample_postures
from robostiff.spatial.batch import empty_batch

# Generic poses must keep away from the tolerances that decide, by what poses may differ.
_STRICT = Tolerance(near_independence=1e-4, near_rigidity=1e-8)
_AGREEMENT = 1e-9
_FREE = 1e-6  # of the largest size: what rounding leaves of zero
_OTHER_SEED = 47
_SUBJECT = "the record of a robot and the wrench basis form"


def is_trusted(recorded: RecordedRobot, inputs: KernelInputs, finder: PostureFinder) -> bool:
    """Whether generic poses of a robot are regular, and its record has been confirmed at them.

    Once at the poses at which it was recorded, and once at others: what a record takes for zero or
    for the same at its own samples must be so elsewhere. Both forms decide for themselves where
    they hold; where both do, they must give the same K, rank and status.

    Returns
    -------
    bool
        False where generic poses are ill-conditioned, the recorded closure arrives at none, or the
        record gives something else where it is unsafe. Then no pose of the robot is left to it.

    Raises
    ------
    DisagreementError
        When they give different results at a pose where both are well conditioned.
    """
    robot = inputs.robot
    kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
    by_joints, length = robot.is_posed_by_joints, recorded.length
    chosen = robot.coordinate_places
    trusted = True
    for seed in (None, _OTHER_SEED):
        posture = sample_postures(finder.robot, finder, seed)
        given = posture.coordinates[0] if by_joints else posture.pose[:, chosen]
        samples = list(parameter_samples(robot, seed).values())
        values = ParameterValues(robot, np.reshape(samples, (len(samples), len(given))))
        pose = JointCoordinates(given) if by_joints else given
        rows = inputs.rows(pose, given, values)
        results = kernel.evaluate(rows.rows)
        met = closes(kernel, results) & ~rows.missed
        found = checked_results(kernel, results, rows.missed, rows.loose, general)
        trusted &= bool(met.any())
        for other, own in values.groups(met):
            part = JointCoordinates(given[own]) if by_joints else given[own]
            result = careful_stiffness(other, part)
            decided = ~(found.guarded[own] | _doubtful(result))
            rows_of_K = found.rows[StiffnessMatrix.name][:, own]
            K = empty_batch((len(own),), result.about_reference.matrix.shape[1:])
            unpack(rows_of_K, K)
            for k, pose_of_k in enumerate(own):
                rank, code = int(found.rank[pose_of_k]), int(found.status_codes[pose_of_k])
                distance = _distance(K[k], rank, code, result[k], length)
                if distance and decided[k]:
                    numbers = np.concatenate([given[pose_of_k], values.rows[:, pose_of_k]])
                    raise DisagreementError(_SUBJECT, distance, _place(robot, numbers))
                trusted &= not distance
            trusted &= not np.any(_doubtful(careful_stiffness(other, part, tolerance=_STRICT)))
    return trusted


def _doubtful(result: RobotStiffness) -> np.ndarray:
    return (result.status_codes & int(Status.ILL_CONDITIONED)) != 0


def _distance(
    K: np.ndarray, rank: int, code: int, result: RobotStiffness, length: float
) -> float | str:
    """How another answer at one pose differs from a result; 0 within rounding."""
    if code != int(result.status):
        return f"on the status, {Status(code)} and {result.status},"
    if rank != int(result.rank):
        return f"on the rank, {rank} and {int(result.rank)},"
    if not result.status.has_stiffness:
        return 0.0
    scale = scaling(np.array(length), result.space)
    size = np.sqrt(np.diag(result.K)) / scale
    # Entries are judged by sqrt(K_ii K_jj), those of free motions not by zero.
    size = np.maximum(size, _FREE * size.max()) * scale
    distance = float(np.max(np.abs(K - result.K) / np.outer(size, size)))
    return 0.0 if distance <= _AGREEMENT else distance


def _place(robot: Robot, numbers: np.ndarray) -> str:
    """Robot, pose and values of parameters, to the last digit."""
    names = [str(symbol) for symbol in robot.symbols]
    pose, values = numbers[: len(numbers) - len(names)], numbers[len(numbers) - len(names) :]
    given = "".join(f", {name} = {x!r}" for name, x in zip(names, values.tolist(), strict=True))
    return f"{robot.name!r} at {pose.tolist()}{given}"
