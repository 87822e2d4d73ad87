"""Compiled robots: a kernel at many poses, and the batched form where its checks fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.compiled_answer import (
    CompiledStiffness,
    checked_outputs,
)
from robostiff.analysis.compiled_linkage import CompiledLinkage, compile_linkage
from robostiff.analysis.kernel_inputs import (
    InputRows,
    KernelInputs,
    ParameterValues,
    with_parameters,
)
from robostiff.analysis.record_agreement import depends_on_what_is_held, is_trusted
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
)
from robostiff.errors import InputError
from robostiff.kinematics import JointCoordinates, Pose, posture_finder
from robostiff.linkage import Linkage
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.recorded import (
    RecordedRobot,
    record_robot,
)


@dataclass(frozen=True, repr=False)
class CompiledRobot(CompiledStiffness):
    """A robot whose stiffness is recorded once and evaluated at millions of poses; picklable.

    Unsafe poses are recomputed by the wrench basis form.

    Attributes
    ----------
    rank, status, verified, kernel
        See `CompiledStiffness`. The kernel takes pose coordinates; those of the legs for an arm
        posed by its joints, and where the closure of the legs has no record: poses are then closed
        by iteration before.
    robot : Robot
        Its symbols are the parameters of the kernel.
    joint_kernel : Kernel or None
        Takes leg coordinates: of an arm, or it is the kernel itself.
    """

    robot: Robot
    joint_kernel: Kernel | None

    @property
    def subject(self) -> Robot:
        """The robot."""
        return self.robot

    @property
    def takes_joints(self) -> bool:
        """Whether it answers at coordinates of legs."""
        return self.joint_kernel is not None

    def _given(
        self, pose: Pose, parameters: Mapping[str, ArrayLike] | None
    ) -> tuple[Kernel, InputRows, np.ndarray, ParameterValues[Robot]]:
        by_joints = self.joint_kernel if isinstance(pose, JointCoordinates) else None
        kernel = by_joints or self.kernel
        inputs = _inputs_of(self.robot, kernel, self.joint_kernel)
        given = inputs.checked(pose)
        values = ParameterValues.of(self.robot, parameters, len(given))
        return kernel, inputs.rows(pose, given, values), given, values

    def _careful(self, robot: Robot, pose: Pose, given: np.ndarray) -> RobotStiffness:
        some = JointCoordinates(given) if isinstance(pose, JointCoordinates) else given
        return careful_stiffness(robot, some)


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
    return CompiledRobot(rank, status, verified, kernel, robot, joint_kernel)


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
