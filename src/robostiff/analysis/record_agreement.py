"""Comparison of a record with the wrench basis form, before it is used."""

from __future__ import annotations

from collections.abc import Iterator

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
#: What a difference is between.
SUBJECT = "the record of a robot and the wrench basis form"


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
    by_joints = robot.is_posed_by_joints
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
            for k, distance in differences(K, found.rank[own], found.status_codes[own], result):
                if decided[k]:
                    numbers = np.concatenate([given[own[k]], values.rows[:, own[k]]])
                    raise DisagreementError(SUBJECT, distance, _place(robot, numbers))
                trusted = False
            trusted &= not np.any(_doubtful(careful_stiffness(other, part, tolerance=_STRICT)))
    return trusted


def _doubtful(result: RobotStiffness) -> np.ndarray:
    return (result.status_codes & int(Status.ILL_CONDITIONED)) != 0


def differences(
    K: np.ndarray, rank: np.ndarray, status_codes: np.ndarray, careful: RobotStiffness
) -> Iterator[tuple[int, float | str]]:
    """Numbers of the poses at which a record differs from the careful form, and by how much.

    Parameters
    ----------
    K : (N, n, n) array
        Of the record, about the reference point.
    rank, status_codes : (N,) arrays
        Of the record.
    careful : RobotStiffness
        At the same poses, of any batch shape.

    Yields
    ------
    tuple of int and (float or str)
        Differences of the status first, then of the rank, then of K, the largest first; none within
        rounding.
    """
    codes, ranks = careful.status_codes.reshape(-1), careful.rank.reshape(-1)
    alike = status_codes == codes
    for i in np.flatnonzero(~alike).tolist():
        yield i, f"on the status, {Status(int(status_codes[i]))} and {Status(int(codes[i]))},"
    for i in np.flatnonzero(alike & (rank != ranks)).tolist():
        yield i, f"on the rank, {int(rank[i])} and {int(ranks[i])},"
    rows = np.flatnonzero(alike & (rank == ranks) & careful.answered.reshape(-1))
    if not rows.size:
        return
    own = careful.matrix.reshape(-1, *K.shape[1:])[rows]
    scale = scaling(careful.about_reference.length.reshape(-1)[rows], careful.space)
    distance = distances(K[rows], own, scale)
    for i in np.argsort(-distance).tolist():
        if not distance[i] <= _AGREEMENT:
            yield int(rows[i]), float(distance[i])


def distances(K: np.ndarray, other: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """How far stiffness matrices are from others, (..., n, n) each; scale (..., n) of wrenches.

    Entries are judged by sqrt(K_ii K_jj) of the other, those of free motions not by zero. Where the
    other vanishes as a whole, as that of legs that transmit nothing does, the distance is 0 or
    infinite.
    """
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", other), 0.0)) / scale
    size = np.maximum(size, _FREE * np.max(size, axis=-1, keepdims=True)) * scale
    each = size[..., :, None] * size[..., None, :]
    apart = np.abs(K - other)
    parts = np.where(apart == 0, 0.0, np.inf)
    np.divide(apart, each, out=parts, where=each > 0)
    return np.max(parts, axis=(-1, -2))


def _place(robot: Robot, numbers: np.ndarray) -> str:
    """Robot, pose and values of parameters, to the last digit."""
    names = [str(symbol) for symbol in robot.symbols]
    pose, values = numbers[: len(numbers) - len(names)], numbers[len(numbers) - len(names) :]
    given = "".join(f", {name} = {x!r}" for name, x in zip(names, values.tolist(), strict=True))
    return f"{robot.name!r} at {pose.tolist()}{given}"
