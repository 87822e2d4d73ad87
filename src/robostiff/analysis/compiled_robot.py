"""Compiled robots: a kernel at many poses, and the batched form where its checks fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.compiled_answer import (
    CompiledAnswer,
    attempted,
    checked_chunks,
    checked_outputs,
    put_careful,
)
from robostiff.analysis.compiled_linkage import CompiledLinkage, compile_linkage
from robostiff.analysis.guarded_values import AtGeneralPoses, CheckedResults
from robostiff.analysis.kernel_inputs import (
    InputRows,
    KernelInputs,
    ParameterValues,
    with_parameters,
)
from robostiff.analysis.record_agreement import depends_on_what_is_held, is_trusted
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
    whole_threads,
)
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Pose, posture_finder
from robostiff.linkage import Linkage
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.recorded import (
    RecordedRobot,
    record_robot,
)


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
        general = AtGeneralPoses(self.rank, self.status, self.verified)
        whole = slice(0, len(inputs.missed))
        yield from checked_chunks(self._kernel_for(pose), inputs, general, whole)

    def _attempt(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None, threads: int
    ) -> tuple[CompiledAnswer, np.ndarray, ParameterValues[Robot]]:
        threads = whole_threads(threads)
        inputs, given, parameter_values = self._inputs_of(pose, parameters)
        general = AtGeneralPoses(self.rank, self.status, self.verified)
        answer = attempted(self._kernel_for(pose), inputs, general, threads)
        return answer, given, parameter_values

    def _inputs_of(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None
    ) -> tuple[InputRows, np.ndarray, ParameterValues[Robot]]:
        inputs = _inputs_of(self.robot, self._kernel_for(pose), self.joint_kernel)
        given = inputs.checked(pose)
        values = ParameterValues.of(self.robot, parameters, len(given))
        return inputs.rows(pose, given, values), given, values

    def _kernel_for(self, pose: Pose) -> Kernel:
        by_joints = self.joint_kernel if isinstance(pose, JointCoordinates) else None
        return by_joints or self.kernel

    def _compute_again(
        self, robot: Robot, pose: Pose, rows: np.ndarray, answer: CompiledAnswer
    ) -> None:
        result = careful_stiffness(robot, pose)
        put_careful(answer, rows, result, self.kernel.outputs, self.rank)


@overload
def compile_robot(
    robot: Robot,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    backend: Backend = Backend.BEST,
) -> CompiledRobot: ...
@overload
def compile_robot(
    robot: Linkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    joints: Sequence[str] | None = None,
    backend: Backend = Backend.BEST,
) -> CompiledLinkage: ...
def compile_robot(
    robot: Robot | Linkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    joints: Sequence[str] | None = None,
    backend: Backend = Backend.BEST,
) -> CompiledRobot | CompiledLinkage:
    """Record the stiffness of a robot or linkage once, for evaluation at millions of poses.

    Closure, frames, elimination of the passive joints and the sum over the legs become a list of
    some hundred operations without branches, which is compiled to SIMD machine code or run by NumPy
    in chunks. Poses where a recorded pivot is unsafe are computed again by the wrench basis form.

    Parameters
    ----------
    robot : Robot or Linkage
        Symbols that are no parameters take their nominal values.
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``WorstDeflection()``, ``Derivative(output, "x")``.
    parameters : sequence of str
        Names of symbols that stay open, to be given with the poses. Working modes are those of
        the nominal values.
    joints : sequence of str, optional
        Of a linkage, the joints that drive it; all actuated ones when left out. The other ones
        follow, as in ``linkage.network_at``.
    backend : Backend
        ``Backend.MACHINE``, ``Backend.ARRAYS``, or the ``BEST`` there is.

    Raises
    ------
    InputError
        When the robot is rigid in some direction, its home is no generic place, or a parameter is
        no symbol of it; when the joints do not decide the configuration of a linkage.
    NoAnswerError
        When an output has no answer at any pose, as the compliance of a platform with free motions.
    DisagreementError
        When the record gives another answer at a generic pose than the wrench basis form, or than
        the network of a linkage.

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
    if isinstance(robot, Linkage):
        return compile_linkage(
            robot, outputs, joints=joints, parameters=parameters, backend=backend
        )
    if not isinstance(robot, Robot):
        raise InputError(
            "robot to compile",
            got=type(robot).__name__,
            expected="a Robot or a Linkage",
            hint='write compile(load("hexapod")), compile(load_linkage("four-bar.xml"))',
        )
    if joints is not None:
        raise InputError(
            f"driven joints of {robot.name!r}",
            got=joints,
            expected="none: a robot with legs takes poses",
        )
    robot.check_platform_is_rigid("kernel")
    robot.check_has_no_springs("kernel")
    outputs = checked_outputs(outputs)
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    robot = _within_its_space(robot)
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder)
    if depends_on_what_is_held(recorded, robot, finder):
        recorded = replace(recorded, closure=None)
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
