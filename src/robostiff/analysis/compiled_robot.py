"""A robot compiled: fast answers at many poses, and slow ones where the fast cannot be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robostiff.analysis.guarded_values import values_of
from robostiff.analysis.stiffness_at_pose import stiffness
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
    rows_of,
    unpacked,
)
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Pose, PostureFinder
from robostiff.model import Robot
from robostiff.record import Entry
from robostiff.recorded import (
    RecordedRobot,
    record_at_joints,
    record_at_pose,
    sample_postures,
)

# Margins of the recorded pivots below which a pose is computed again. The record loses about as
# many digits as a margin has zeros, so that six of sixteen leave ten.
_SAFE = 1e-6
# A leg shorter by this part of itself is certainly out of reach.
_OUT_OF_REACH = -1e-9
_AGREEMENT = 1e-9


@dataclass(frozen=True)
class CompiledAnswer:
    """What a compiled robot says of a batch of poses.

    Attributes
    ----------
    values : dict of names to (N, ...) arrays
        One array an output; not a number where the status says that there is no answer.
    status_codes : (N,) array of uint8
        See `Status`.
    rank : (N,) array of int8
        -1 where out of reach.
    guarded : (N,) array of bool
        Poses that were computed again by the wrench basis form on batches.
    """

    values: dict[str, np.ndarray]
    status_codes: np.ndarray
    rank: np.ndarray
    guarded: np.ndarray

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were computed again."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0


@dataclass(frozen=True)
class CompiledRobot:
    """A robot whose stiffness is recorded once and evaluated at millions of poses; picklable.

    Attributes
    ----------
    robot : Robot
    kernel : Kernel
    takes_joints : bool
        Whether the inputs of the kernel are leg coordinates; platform poses are then closed by
        iteration before.
    rank : int
        At a general pose.
    status : Status
        At a general pose.
    verified : bool
        Whether record and wrench basis form agree at generic poses; otherwise every pose is
        computed by the latter.
    """

    robot: Robot
    kernel: Kernel
    takes_joints: bool
    rank: int
    status: Status
    verified: bool

    def evaluate(self, pose: Pose, *, threads: int = 1) -> CompiledAnswer:
        """Outputs, status and rank at many poses.

        Parameters
        ----------
        pose : (N, n) array or JointCoordinates
            The robot's free pose coordinates, one pose a row [m, rad]; joint coordinates for a
            serial arm. Fastest where equal coordinates of all poses lie side by side in memory.
        threads : int

        Raises
        ------
        InputError
            When the poses do not fit the robot.
        """
        rows, out_of_reach = self._inputs(pose)
        results = self.kernel.evaluate(rows, threads=threads)
        values, start = {}, 0
        for output in self.kernel.outputs:
            shape = output.shape(self.robot.space)
            stop = start + rows_of(shape)
            values[output.name] = unpacked(results[start:stop], shape)
            start = stop
        checks = dict(zip(self.kernel.checks, results[start:], strict=True))
        status = np.full(rows.shape[1], int(self.status), dtype=np.uint8)
        rank = np.full(rows.shape[1], self.rank, dtype=np.int8)
        if "limits" in checks:
            status |= np.where(checks["limits"] < 0, np.uint8(Status.BEYOND_LIMITS), np.uint8(0))
        guarded = self._guarded(checks, rows.shape[1])
        if "reach" in checks and not self._open:
            out_of_reach = out_of_reach | (checks["reach"] < _OUT_OF_REACH)
        status[out_of_reach], rank[out_of_reach] = int(Status.UNREACHABLE), -1
        guarded &= ~out_of_reach
        for array in values.values():
            array[out_of_reach] = np.nan
        answer = CompiledAnswer(values, status, rank, guarded)
        if np.any(guarded):
            self._compute_again(pose, answer)
        return answer

    def _inputs(self, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        """Rows of kernel inputs, and which poses are known to be out of reach."""
        if isinstance(pose, JointCoordinates):
            q = np.asarray(pose.values, dtype=float)
            self._check_shape(q, self.robot.legs[0].chain.size if self.takes_joints else -1)
            return np.ascontiguousarray(q.T), np.zeros(len(q), dtype=bool)
        given = np.asarray(pose, dtype=float)
        self._check_shape(given, len(self.robot.coordinates))
        if not self.takes_joints:
            return np.ascontiguousarray(given.T), np.zeros(len(given), dtype=bool)
        posture = PostureFinder(self.robot).find(given)
        rows = np.concatenate([q.T for q in posture.coordinates])
        return np.ascontiguousarray(rows), ~posture.reached

    def _check_shape(self, given: np.ndarray, count: int) -> None:
        if given.ndim != 2 or given.shape[1] != count or not np.isfinite(given).all():
            raise InputError(
                f"poses of {self.robot.name!r}",
                got=given.shape,
                expected=f"finite numbers (N, {count}), one pose a row",
            )

    @property
    def _open(self) -> bool:
        """Whether the legs decide some pose coordinates, which may bring a leg back into reach."""
        return len(self.robot.coordinates) < len(self.robot.space.rows)

    def _guarded(self, checks: dict[str, np.ndarray], count: int) -> np.ndarray:
        if not self.verified:
            return np.ones(count, dtype=bool)
        guarded = ~np.isfinite(checks["trace"]) if "trace" in checks else np.zeros(count, bool)
        for name in {"margin", "rank", "reach"} & checks.keys():
            guarded |= ~(checks[name] > _SAFE)
        return guarded

    def _compute_again(self, pose: Pose, answer: CompiledAnswer) -> None:
        rows = answer.guarded
        given = (
            JointCoordinates(np.asarray(pose.values)[rows])
            if isinstance(pose, JointCoordinates)
            else np.asarray(pose)[rows]
        )
        result = stiffness(self.robot, given)
        answer.status_codes[rows] = result.status_codes
        answer.rank[rows] = result.rank
        for output in self.kernel.outputs:
            if isinstance(output, Derivative):
                # There is no second way to a derivative: the digits lost are told instead.
                answer.status_codes[rows] |= np.uint8(Status.ILL_CONDITIONED)
                continue
            answer.values[output.name][rows] = values_of(output, result)


def compile_robot(
    robot: Robot,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    backend: Backend = Backend.BEST,
) -> CompiledRobot:
    """Record the stiffness of a robot once, for evaluation at millions of poses.

    Closure, frames, elimination of the passive joints and the sum over the legs become a list of
    some hundred operations without branches, which is compiled to SIMD machine code or run by NumPy
    in chunks. Poses where a recorded pivot is unsafe are computed again by the wrench basis form.

    Parameters
    ----------
    robot : Robot
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``Derivative(output, "x")``.
    backend : Backend
        ``Backend.MACHINE``, ``Backend.ARRAYS``, or the ``BEST`` there is.

    Raises
    ------
    InputError
        When the robot is rigid in some direction, or its home is no generic place.
    NoAnswerError
        When an output has no answer at any pose, as the compliance of a platform with free motions.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b")
    >>> fast = rs.compile(robot)
    >>> poses = np.zeros((1000, 6)) + [0, 0, 0.5, 0, 0, 0.1]
    >>> answer = fast.evaluate(poses)
    >>> bool(np.allclose(answer.values["K"][0], rs.stiffness(robot, poses[0]).K, rtol=1e-9))
    True
    """
    finder = PostureFinder(robot)
    recorded, takes_joints = _recorded(robot, finder)
    kernel = kernel_of(recorded, outputs, backend)
    compiled = CompiledRobot(
        robot, kernel, takes_joints, recorded.factors.rank, recorded.status, verified=True
    )
    return replace(compiled, verified=_agrees(recorded, robot, finder))


def _recorded(robot: Robot, finder: PostureFinder) -> tuple[RecordedRobot, bool]:
    """The robot's record, and whether its inputs are the coordinates of the legs."""
    by_joints = robot.is_serial and robot.home is None
    closed = not by_joints and all(s.closed_form is not None for s in finder.solvers)
    if closed:
        recorded = record_at_pose(robot, finder)
        if not _misses(recorded):
            return recorded, False
    return record_at_joints(robot, finder), True


def _misses(recorded: RecordedRobot) -> bool:
    """Whether a leg misses the platform at generic poses: the open coordinates must give way."""
    return any(np.any(m.sample < 0) for m in recorded.margins if isinstance(m, Entry))


def _agrees(recorded: RecordedRobot, robot: Robot, finder: PostureFinder) -> bool:
    """Whether record and wrench basis form tell the same at the samples."""
    posture = sample_postures(robot, finder)
    by_joints = robot.is_serial and robot.home is None
    pose = JointCoordinates(posture.coordinates[0]) if by_joints else posture.pose
    result = stiffness(robot, pose)
    if np.any(result.rank != recorded.factors.rank):
        return False
    if np.any(result.status_codes & ~np.uint8(Status.BEYOND_LIMITS) != int(recorded.status)):
        return False
    size = np.sqrt(np.einsum("...ii->...i", result.K))
    for (i, j), entry in recorded.K.items():
        own = entry.sample if isinstance(entry, Entry) else float(entry)
        if np.any(np.abs(own - result.K[:, i, j]) > _AGREEMENT * size[:, i] * size[:, j]):
            return False
    return True
