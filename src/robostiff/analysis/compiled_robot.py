"""A robot compiled: fast answers at many poses, and slow ones where the fast cannot be trusted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.guarded_values import values_of
from robostiff.analysis.kernel_inputs import KernelInputs
from robostiff.analysis.parameter_values import ParameterValues, with_parameters
from robostiff.analysis.record_agreement import agrees
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
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.record import Entry
from robostiff.recorded import (
    SHORT,
    RecordedRobot,
    record_at_joints,
    record_at_pose,
)

# Losses of the recorded pivots above which a pose is computed again; their squares are summed. The
# record loses about as many digits as a loss has, and several one after the other more. Stiffness
# falls with the square of the wrenches that hold it: of those, at most a hundredth is lost.
_SAFE = 1e4**2
_OUT_OF_REACH = -1e-3  # of `RecordedRobot.reach`: certainly out of reach
# An actuator nearer to a limit than this part of its range is looked at again.
_AT_LIMIT = 1e-9
# A gap between eigenvalues, as a part of them, below which their derivatives are rounding.
_APART = 1e-7


@dataclass(frozen=True, repr=False)
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

    def __repr__(self) -> str:
        names = ", ".join(self.values)
        share = f"{self.guarded_share:.2%} computed again"
        return f"<CompiledAnswer of {len(self.rank)} poses: {names}; {share}>"

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were computed again."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0


@dataclass(frozen=True, repr=False)
class CompiledRobot:
    """A robot whose stiffness is recorded once and evaluated at millions of poses; picklable.

    Attributes
    ----------
    robot : Robot
        Its symbols are the parameters of the kernel.
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

    def __repr__(self) -> str:
        names = ", ".join(output.name for output in self.kernel.outputs)
        inputs = ", ".join(self.kernel.inputs)
        return (
            f"<CompiledRobot {self.robot.name!r}: {names} at {inputs}, "
            f"{self.kernel.operations} operations>"
        )

    @property
    def parameters(self) -> tuple[str, ...]:
        """What may differ from pose to pose beside the coordinates."""
        return tuple(str(symbol) for symbol in self.robot.symbols)

    def evaluate(
        self,
        pose: Pose,
        *,
        parameters: Mapping[str, ArrayLike] | None = None,
        threads: int = 1,
    ) -> CompiledAnswer:
        """Outputs, status and rank at many poses.

        Parameters
        ----------
        pose : (N, n) array or JointCoordinates
            The robot's free pose coordinates, one pose a row [m, rad]; joint coordinates for a
            serial arm. Fastest where equal coordinates of all poses lie side by side in memory.
        parameters : mapping of str to a number or (N,) array, optional
            Values of parameters, in SI units; nominal where left out.
        threads : int

        Raises
        ------
        InputError
            When the poses or the parameters do not fit the robot.
        """
        answer, values = self._attempt(pose, parameters, threads)
        for robot, rows in values.groups(answer.guarded):
            self._compute_again(robot, pose, rows, answer)
        return answer

    def attempt(
        self,
        pose: Pose,
        *,
        parameters: Mapping[str, ArrayLike] | None = None,
        threads: int = 1,
    ) -> CompiledAnswer:
        """As `evaluate`, but poses that are ``guarded`` are left to the caller.

        What stands there in the answer must not be used.
        """
        return self._attempt(pose, parameters, threads)[0]

    def _attempt(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None, threads: int
    ) -> tuple[CompiledAnswer, ParameterValues]:
        inputs = self._inputs
        given = inputs.checked(pose)
        parameter_values = ParameterValues.of(self.robot, parameters, len(given))
        rows, out_of_reach = inputs.rows(pose, given, parameter_values)
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
        if "reach" in checks:
            out_of_reach = out_of_reach | (checks["reach"] < _OUT_OF_REACH)
        status[out_of_reach], rank[out_of_reach] = int(Status.UNREACHABLE), -1
        guarded &= ~out_of_reach
        # Eigenvalues have no derivatives where two of them meet.
        meet = ~(checks["gap"] > _APART) & ~out_of_reach if "gap" in checks else None
        for output in self.kernel.outputs:
            array = values[output.name]
            array[out_of_reach] = np.nan
            if isinstance(output, Derivative) and meet is not None:
                array[meet] = np.nan
                status[meet] |= np.uint8(Status.ILL_CONDITIONED)
        return CompiledAnswer(values, status, rank, guarded), parameter_values

    @property
    def _inputs(self) -> KernelInputs:
        joints = len(self.kernel.inputs) - len(self.robot.symbols) if self.takes_joints else 0
        return KernelInputs(self.robot, joints)

    def _guarded(self, checks: dict[str, np.ndarray], count: int) -> np.ndarray:
        if not self.verified:
            return np.ones(count, dtype=bool)
        guarded = ~np.isfinite(checks["trace"])
        for name in {"loss", "rank"} & checks.keys():
            guarded |= ~(checks[name] < _SAFE)
        if "reach" in checks:
            guarded |= ~(checks["reach"] > SHORT)
        if "limits" in checks:
            guarded |= ~(np.abs(checks["limits"]) > _AT_LIMIT)
        return guarded

    def _compute_again(
        self, robot: Robot, pose: Pose, rows: np.ndarray, answer: CompiledAnswer
    ) -> None:
        given = (
            JointCoordinates(np.asarray(pose.values)[rows])
            if isinstance(pose, JointCoordinates)
            else np.asarray(pose)[rows]
        )
        result = stiffness(robot, given)
        answer.status_codes[rows] = result.status_codes
        answer.rank[rows] = result.rank
        for output in self.kernel.outputs:
            if isinstance(output, Derivative):
                # There is no second way to a derivative: the digits lost are told instead. Where
                # the rank is another, K jumps.
                answer.status_codes[rows] |= np.uint8(Status.ILL_CONDITIONED)
                jumps = ~result.answered | (result.rank != self.rank)
                answer.values[output.name][rows[jumps]] = np.nan
                continue
            answer.values[output.name][rows] = values_of(output, result)


def compile_robot(
    robot: Robot,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    backend: Backend = Backend.BEST,
) -> CompiledRobot:
    """Record the stiffness of a robot once, for evaluation at millions of poses.

    Closure, frames, elimination of the passive joints and the sum over the legs become a list of
    some hundred operations without branches, which is compiled to SIMD machine code or run by NumPy
    in chunks. Poses where a recorded pivot is unsafe are computed again by the wrench basis form.

    Parameters
    ----------
    robot : Robot
        Symbols that are no parameters take their nominal values.
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``WorstDeflection()``, ``Derivative(output, "x")``.
    parameters : sequence of str
        Names of symbols that stay open, to be given with the poses. Working modes are those of
        the nominal values.
    backend : Backend
        ``Backend.MACHINE``, ``Backend.ARRAYS``, or the ``BEST`` there is.

    Raises
    ------
    InputError
        When the robot is rigid in some direction, its home is no generic place, or a parameter is
        no symbol of it.
    NoAnswerError
        When an output has no answer at any pose, as the compliance of a platform with free motions.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b")
    >>> fast = rs.compile(robot)
    >>> poses = np.zeros((1000, 6)) + [0, 0, 0.5, 0, 0, 0.1]
    >>> answer = fast.evaluate(poses)
    >>> K = rs.stiffness(robot, poses[0]).K
    >>> bool(np.allclose(answer.values["K"][0], K, rtol=1e-9, atol=1e-9 * K.max()))
    True
    >>> robot = rs.load("gough-stewart-b", symbols=("R", "k"))
    >>> fast = rs.compile(robot, [rs.PrincipalStiffness()], parameters=("R",))
    >>> answer = fast.evaluate(poses, parameters={"R": np.linspace(0.4, 0.6, 1000)})
    >>> answer.values["principal_stiffness"].shape
    (1000, 6)
    """
    if not isinstance(robot, Robot):
        raise InputError(
            "robot to compile",
            got=type(robot).__name__,
            expected="a Robot",
            hint='write compile(load("hexapod"))',
        )
    outputs = _checked_outputs(outputs)
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    robot = _within_its_space(robot)
    finder = PostureFinder(robot.numeric)
    recorded, takes_joints = _recorded(robot, finder)
    for output in outputs:
        _check_derivative(output, robot, takes_joints)
    kernel = kernel_of(recorded, outputs, backend)
    compiled = CompiledRobot(
        robot, kernel, takes_joints, recorded.factors.rank, recorded.status, verified=True
    )
    return replace(compiled, verified=agrees(recorded, compiled._inputs, finder))


def _within_its_space(robot: Robot) -> Robot:
    """The robot without the coordinates that leave its plane, which are those of home."""
    inside = [ALL_COORDINATES[row] for row in robot.space.rows]
    return replace(robot, coordinates=tuple(c for c in robot.coordinates if c in inside))


def _checked_outputs(outputs: Sequence[Output]) -> tuple[Output, ...]:
    kinds = "StiffnessMatrix(), PrincipalStiffness()"
    if not isinstance(outputs, Sequence) or not outputs:
        raise InputError(
            "outputs to compile", got=outputs, expected="several", hint=f"write [{kinds}]"
        )
    for output in outputs:
        if isinstance(output, type) or not isinstance(output, Output):
            raise InputError("output to compile", got=output, expected=f"such as {kinds}")
    names = [output.name for output in outputs]
    if len(set(names)) < len(names):
        raise InputError(
            "outputs to compile",
            got=names,
            expected="each name once",
            hint="compile the robot once for each load case",
        )
    return tuple(outputs)


def _check_derivative(output: Output, robot: Robot, takes_joints: bool) -> None:
    """Raise where the inputs of the kernel cannot change one at a time."""
    if isinstance(output, Derivative) and takes_joints and not robot.is_posed_by_joints:
        raise InputError(
            f"derivative by {output.by}",
            got=f"{robot.name!r}, whose legs are closed by iteration",
            expected="a robot whose legs have a closed form",
            hint="take differences of rs.stiffness at two poses instead",
        )


def _recorded(robot: Robot, finder: PostureFinder) -> tuple[RecordedRobot, bool]:
    """The robot's record, and whether its inputs are the coordinates of the legs."""
    by_joints = robot.is_posed_by_joints
    if not by_joints and all(s.closed_form is not None for s in finder.solvers):
        recorded = record_at_pose(robot, finder)
        if not _misses(recorded):
            return recorded, False
    return record_at_joints(robot, finder), True


def _misses(recorded: RecordedRobot) -> bool:
    """Whether a leg misses the platform at generic poses: the open coordinates must give way."""
    return any(np.any(part.sample < 0) for part in recorded.reach if isinstance(part, Entry))
