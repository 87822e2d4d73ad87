"""Comparison of a record with the wrench basis form, before it is used."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robostiff.analysis.careful_form import AskedPoses, careful_stiffness
from robostiff.analysis.compiled_answer import AtGeneralPoses, checked_results, closes
from robostiff.analysis.kernel_inputs import InputRows, KernelInputs, ParameterValues
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import Backend, Kernel, StiffnessMatrix, kernel_of, unpack
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
_FREE = AskedPoses.free
_OTHER_SEED = 47
_NEARER = 4  # how often poses are drawn nearer to home
_SPUN = 0.2  # what coordinates that nothing determines are changed by [m, rad]
#: What a difference is between.
SUBJECT = AskedPoses.opinions


def is_trusted(recorded: RecordedRobot, inputs: KernelInputs, finder: PostureFinder) -> bool:
    """Whether generic poses of a robot are regular, and its record has been confirmed at them.

    Once at the poses at which it was recorded, and once at others: what a record takes for zero or
    for the same at its own samples must be so elsewhere. Both forms decide for themselves where
    they hold; where both do, they must give the same K, rank and status. Where the recorded closure
    arrives at none of the poses, it is asked at nearer ones.

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
    general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
    kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    trusted = True
    for seed in (None, _OTHER_SEED):
        at = _Sampled.of(robot, finder, kernel, inputs, (seed, 0))
        for nearer in range(1, _NEARER):
            if at.met.any():
                break
            at = _Sampled.of(robot, finder, kernel, inputs, (seed, nearer))
        trusted &= bool(at.met.any()) and at.agrees(general)
    return trusted


def depends_on_what_is_held(recorded: RecordedRobot, robot: Robot, finder: PostureFinder) -> bool:
    """Whether K differs between postures of one pose that differ in coordinates that are held.

    A rod that spins between spherical joints is held by nothing, and transmits the same. A passive
    joint that folds a chain of beams is held by nothing either, but K depends on the fold: there
    the record and the careful closure may be at different postures.
    """
    held = () if recorded.closure is None else recorded.closure.held
    if not held:
        return False
    posture = sample_postures(finder.robot, finder)
    moved = np.isin(recorded.joints, held) * _SPUN
    ends = np.cumsum([leg.chain.size for leg in robot.legs])[:-1]
    for row, pose in enumerate(posture.pose):
        q = [own[row] for own in posture.coordinates]
        here, there = (
            careful_stiffness(finder.robot, pose, near=near)
            for near in (q, np.split(np.concatenate(q) + moved, ends))
        )
        if not (here.answered and there.answered):
            return True
        K, rank, codes = here.matrix[None], here.rank[None], here.status_codes[None]
        if next(differences(K, rank, codes, there), None) is not None:
            return True
    return False


@dataclass(frozen=True)
class _Sampled:
    """A kernel of K at generic poses.

    Attributes
    ----------
    robot : Robot
    kernel : Kernel
    given : (N, n) array
        Coordinates.
    values : ParameterValues
    rows : InputRows
    results : (rows, N) array
    met : (N,) array of bool
        Where the recorded closure arrives.
    """

    robot: Robot
    kernel: Kernel
    given: np.ndarray
    values: ParameterValues
    rows: InputRows
    results: np.ndarray
    met: np.ndarray

    @classmethod
    def of(
        cls,
        robot: Robot,
        finder: PostureFinder,
        kernel: Kernel,
        inputs: KernelInputs,
        drawn: tuple[int | None, int],
    ) -> _Sampled:
        """At samples drawn with a seed, and so near home."""
        posture = sample_postures(finder.robot, finder, *drawn)
        by_joints = robot.is_posed_by_joints
        given = posture.coordinates[0] if by_joints else posture.pose[:, robot.coordinate_places]
        samples = list(parameter_samples(robot, drawn[0]).values())
        values = ParameterValues(robot, np.reshape(samples, (len(samples), len(given))))
        rows = inputs.rows(_pose(robot, given), given, values)
        results = kernel.evaluate(rows.rows)
        met = closes(kernel, results) & ~rows.missed
        return cls(robot, kernel, given, values, rows, results, met)

    def agrees(self, general: AtGeneralPoses) -> bool:
        """Whether it gives what the wrench basis form gives, and nothing is in doubt."""
        robot, rows = self.robot, self.rows
        found = checked_results(self.kernel, self.results, rows.missed, rows.loose, general)
        trusted = True
        for other, own in self.values.groups(self.met):
            part = _pose(robot, self.given[own])
            result = careful_stiffness(other, part)
            decided = ~(found.guarded[own] | _doubtful(result))
            K = empty_batch((len(own),), result.about_reference.matrix.shape[1:])
            unpack(found.rows[StiffnessMatrix.name][:, own], K)
            for k, distance in differences(K, found.rank[own], found.status_codes[own], result):
                if decided[k]:
                    numbers = np.concatenate([self.given[own[k]], self.values.rows[:, own[k]]])
                    raise DisagreementError(SUBJECT, distance, _place(robot, numbers))
                trusted = False
            trusted &= not np.any(_doubtful(careful_stiffness(other, part, tolerance=_STRICT)))
        return trusted


def _pose(robot: Robot, given: np.ndarray) -> JointCoordinates | np.ndarray:
    return JointCoordinates(given) if robot.is_posed_by_joints else given


def _doubtful(result: RobotStiffness) -> np.ndarray:
    return (result.status_codes & int(Status.ILL_CONDITIONED)) != 0


def differences(
    K: np.ndarray,
    rank: np.ndarray,
    status_codes: np.ndarray,
    careful: RobotStiffness,
    *,
    free: float = _FREE,
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
    free : float
        Of the largest size: what rounding leaves of zero.

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
    distance = distances(K[rows], own, scale, free)
    for i in np.argsort(-distance).tolist():
        if not distance[i] <= _AGREEMENT:
            yield int(rows[i]), float(distance[i])


def distances(
    K: np.ndarray, other: np.ndarray, scale: np.ndarray, free: float = _FREE
) -> np.ndarray:
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


def _place(robot: Robot, numbers: np.ndarray) -> str:
    """Robot, pose and values of parameters, to the last digit."""
    names = [str(symbol) for symbol in robot.symbols]
    pose, values = numbers[: len(numbers) - len(names)], numbers[len(numbers) - len(names) :]
    given = "".join(f", {name} = {x!r}" for name, x in zip(names, values.tolist(), strict=True))
    return f"{robot.name!r} at {pose.tolist()}{given}"
