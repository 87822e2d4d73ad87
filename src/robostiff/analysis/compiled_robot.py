"""Compiled robots: a kernel at many poses, and the batched form where its checks fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.guarded_values import (
    AtGeneralPoses,
    CheckedResults,
    checked_results,
    values_of,
)
from robostiff.analysis.kernel_inputs import (
    InputRows,
    KernelInputs,
    ParameterValues,
    with_parameters,
)
from robostiff.analysis.record_agreement import is_trusted
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
    unpack,
    whole_threads,
)
from robostiff.compiled.kernel import POSES_A_CHUNK, chunks_of, in_shares
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Pose, posture_finder
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.recorded import (
    RecordedRobot,
    record_robot,
)
from robostiff.spatial.batch import empty_batch


@dataclass(frozen=True, repr=False)
class CompiledAnswer:
    """The result of a compiled robot at a batch of poses.

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
        share = f"{self.guarded_share:.2%} recomputed"
        return f"<CompiledAnswer of {len(self.rank)} poses: {names}; {share}>"

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were recomputed."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0


@dataclass(frozen=True, repr=False)
class CompiledRobot:
    """A robot whose stiffness is recorded once and evaluated at millions of poses; picklable.

    Attributes
    ----------
    robot : Robot
        Its symbols are the parameters of the kernel.
    kernel : Kernel
        Takes pose coordinates; those of the legs for an arm posed by its joints, and where the
        closure of the legs has no record: poses are then closed by iteration before.
    joint_kernel : Kernel or None
        Takes leg coordinates: of an arm, or it is the kernel itself.
    rank : int
        At a general pose.
    status : Status
        At a general pose.
    verified : bool
        Whether record and wrench basis form were found to agree at generic poses; False where those
        are ill-conditioned, or recorded steps reach none of them, and every pose is then computed
        by the latter.
    """

    robot: Robot
    kernel: Kernel
    joint_kernel: Kernel | None
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
    def takes_joints(self) -> bool:
        """Whether it answers at coordinates of legs."""
        return self.joint_kernel is not None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which may differ from pose to pose."""
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
        answer, given, values = self._attempt(pose, parameters, threads)
        by_joints = isinstance(pose, JointCoordinates)
        for robot, rows in values.groups(answer.guarded):
            some = JointCoordinates(given[rows]) if by_joints else given[rows]
            self._compute_again(robot, some, rows, answer)
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

    def results(
        self, pose: Pose, *, parameters: Mapping[str, ArrayLike] | None = None
    ) -> Iterator[tuple[slice, CheckedResults]]:
        """Which poses, and rows of results at them, in chunks of a size that suits the cache.

        Each chunk must be used before the next is asked for: it takes its place. Poses that are
        ``guarded`` are left to the caller.

        Raises
        ------
        InputError
            When the poses or the parameters do not fit the robot.
        """
        inputs, _, _ = self._inputs_of(pose, parameters)
        yield from self._checked(self._kernel_for(pose), inputs, slice(0, len(inputs.missed)))

    def _attempt(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None, threads: int
    ) -> tuple[CompiledAnswer, np.ndarray, ParameterValues]:
        threads = whole_threads(threads)
        inputs, given, parameter_values = self._inputs_of(pose, parameters)
        kernel, count = self._kernel_for(pose), len(inputs.missed)
        answer = CompiledAnswer(
            values={
                output.name: empty_batch((count,), output.shape(self.robot.space))
                for output in self.kernel.outputs
            },
            status_codes=np.empty(count, dtype=np.uint8),
            rank=np.empty(count, dtype=np.int8),
            guarded=np.empty(count, dtype=bool),
        )

        def fill(part: slice) -> None:
            for where, found in self._checked(kernel, inputs, part):
                for name, values in answer.values.items():
                    unpack(found.rows[name], values[where])
                answer.status_codes[where] = found.status_codes
                answer.rank[where] = found.rank
                answer.guarded[where] = found.guarded

        in_shares(fill, count, threads)
        return answer, given, parameter_values

    def _inputs_of(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None
    ) -> tuple[InputRows, np.ndarray, ParameterValues]:
        inputs = _inputs_of(self.robot, self._kernel_for(pose), self.joint_kernel)
        given = inputs.checked(pose)
        values = ParameterValues.of(self.robot, parameters, len(given))
        return inputs.rows(pose, given, values), given, values

    def _kernel_for(self, pose: Pose) -> Kernel:
        by_joints = self.joint_kernel if isinstance(pose, JointCoordinates) else None
        return by_joints or self.kernel

    def _checked(
        self, kernel: Kernel, inputs: InputRows, part: slice
    ) -> Iterator[tuple[slice, CheckedResults]]:
        general = AtGeneralPoses(self.rank, self.status, self.verified)
        buffer = np.empty((kernel.rows, min(POSES_A_CHUNK, part.stop - part.start)))
        for where in chunks_of(part):
            count = where.stop - where.start
            room = buffer if count == buffer.shape[1] else np.empty((len(buffer), count))
            results = kernel.evaluate(inputs.rows[:, where], room)
            missed, loose = inputs.missed[where], inputs.loose[where]
            yield where, checked_results(kernel, results, missed, loose, general)

    def _compute_again(
        self, robot: Robot, pose: Pose, rows: np.ndarray, answer: CompiledAnswer
    ) -> None:
        result = careful_stiffness(robot, pose)
        answer.status_codes[rows] = result.status_codes
        answer.rank[rows] = result.rank
        for output in self.kernel.outputs:
            if isinstance(output, Derivative):
                # Derivatives are not recomputed: the loss of digits is reported instead. Where
                # the rank is another, K jumps.
                answer.status_codes[rows] |= np.uint8(Status.ILL_CONDITIONED)
                jumps = ~result.answered | (result.rank != self.rank)
                answer.values[output.name][rows[jumps]] = np.nan
                continue
            values, unbalanced = values_of(output, result)
            answer.values[output.name][rows] = values
            answer.status_codes[rows] |= unbalanced * np.uint8(Status.UNBALANCED)


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
    DisagreementError
        When the record and the wrench basis form give different answers at a generic pose.

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
    robot.check_platform_is_rigid("kernel")
    robot.check_has_no_springs("kernel")
    outputs = _checked_outputs(outputs)
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    robot = _within_its_space(robot)
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder)
    for output in outputs:
        _check_derivative(output, robot, recorded)
    joint_kernel = None
    if recorded.closure is not None and robot.is_serial and not _by_pose(outputs):
        joint_kernel = kernel_of(replace(recorded, closure=None), outputs, backend)
    kernel = kernel_of(recorded, outputs, backend)
    if recorded.joints and recorded.closure is None:
        joint_kernel = kernel
    inputs = _inputs_of(robot, kernel, joint_kernel)
    verified = is_trusted(recorded, inputs, finder)
    rank, status = recorded.factors.rank, recorded.status
    return CompiledRobot(robot, kernel, joint_kernel, rank, status, verified)


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


def _by_pose(outputs: Sequence[Output]) -> bool:
    """Whether an output is a derivative by a pose coordinate."""
    names = {coordinate.value for coordinate in ALL_COORDINATES}
    return any(isinstance(output, Derivative) and output.by in names for output in outputs)


def _check_derivative(output: Output, robot: Robot, recorded: RecordedRobot) -> None:
    """Raise where a derivative needs more of the closure than its Newton steps give."""
    if not (isinstance(output, Derivative) and recorded.joints and not robot.is_posed_by_joints):
        return
    if recorded.closure is None or isinstance(output.of, Derivative):
        raise InputError(
            f"derivative {output.name}",
            got=f"{robot.name!r}, whose legs are closed by iteration",
            expected="first derivatives, of a robot with a kernel from pose to matrix",
            hint="take differences of rs.stiffness at two poses instead",
        )


def _inputs_of(robot: Robot, kernel: Kernel, joint_kernel: Kernel | None) -> KernelInputs:
    joints = len(kernel.inputs) - len(robot.symbols) if kernel is joint_kernel else 0
    return KernelInputs(robot, joints)
