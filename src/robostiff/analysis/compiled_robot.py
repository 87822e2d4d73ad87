"""Compiled robots: a kernel at many poses, confirmed by the wrench basis form before it is used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.careful_form import AskedPoses, careful_stiffness
from robostiff.analysis.compiled_answer import (
    AtGeneralPoses,
    CompiledStiffness,
    RecordedRanks,
    attempted,
    checked_outputs,
    closes,
)
from robostiff.analysis.compiled_linkage import CompiledLinkage, compile_linkage
from robostiff.analysis.kernel_inputs import (
    InputRows,
    KernelInputs,
    ParameterValues,
    at_joints,
    with_parameters,
)
from robostiff.analysis.measures import differences
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
)
from robostiff.elastostatics import Status, Tolerance
from robostiff.errors import DisagreementError, InputError
from robostiff.kinematics import JointCoordinates, Pose, PostureFinder, posture_finder
from robostiff.linkage import Linkage
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.recorded import (
    RecordedRobot,
    parameter_samples,
    record_at_joints,
    record_robot,
    sample_postures,
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
        pose = at_joints(self.robot, pose)
        by_joints = self.joint_kernel if isinstance(pose, JointCoordinates) else None
        kernel = by_joints or self.kernel
        if kernel is self.joint_kernel and not isinstance(pose, JointCoordinates):
            self._check_poses(kernel)
        inputs = _inputs_of(self.robot, kernel, self.joint_kernel)
        given = inputs.checked(pose)
        values = ParameterValues.of(self.robot, parameters, len(given))
        return kernel, inputs.rows(pose, given, values), given, values

    def _check_poses(self, kernel: Kernel) -> None:
        """Raise where rates with parameters, of a record at joints, would be asked at poses."""
        names = {str(symbol) for symbol in self.robot.symbols}
        for output in kernel.outputs:
            rate = output
            while isinstance(rate, Derivative):
                if rate.by in names:
                    raise InputError(
                        f"{output.name} of {self.robot.name!r}",
                        got="poses of the platform",
                        expected="JointCoordinates, which stay while the parameter changes",
                    )
                rate = rate.of

    def _careful(self, robot: Robot, pose: Pose, given: np.ndarray) -> RobotStiffness:
        pose = at_joints(self.robot, pose)
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
    several hundred to two thousand operations without branches, which is compiled to SIMD machine
    code or run by NumPy in chunks. Poses where a recorded pivot is unsafe are computed again by the
    wrench basis form.

    Parameters
    ----------
    robot : Robot or Linkage
        Symbols that are no parameters take their nominal values.
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``WorstDeflection()``, ``Derivative(output, "x")``.
    parameters : sequence of str
        Names of symbols that remain inputs, to be given with the poses. Working modes are those of
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
    return recorded_and_compiled(robot, outputs, parameters, backend)


def recorded_and_compiled(
    robot: Robot,
    outputs: Sequence[Output],
    parameters: Sequence[str],
    backend: Backend,
    most: int | None = None,
) -> CompiledRobot:
    """As `compile_robot`; a record of more than `most` operations is a `NoAnswerError`."""
    robot.check_has_no_springs("kernel")
    outputs = checked_outputs(outputs)
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    # Coordinates that leave the plane of a planar robot are those of home.
    inside = [ALL_COORDINATES[row] for row in robot.space.rows]
    robot = replace(robot, coordinates=tuple(c for c in robot.coordinates if c in inside))
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder, most)
    if _depends_on_what_is_held(recorded, robot, finder):
        recorded = record_at_joints(robot, finder, most)
    # A derivative may need more of the closure than its Newton steps give.
    iterated = recorded.joints and not robot.is_posed_by_joints
    for output in outputs:
        if not (iterated and isinstance(output, Derivative)):
            continue
        if recorded.closure is None or isinstance(output.of, Derivative):
            raise InputError(
                f"derivative {output.name}",
                got=f"{robot.name!r}, whose legs are closed by iteration",
                expected="first derivatives, of a robot with a kernel from pose to matrix",
                hint="take differences of rs.stiffness at two poses instead",
            )
    joint_kernel = None
    names = {coordinate.value for coordinate in ALL_COORDINATES}
    by_pose = any(isinstance(output, Derivative) and output.by in names for output in outputs)
    if recorded.closure is not None and robot.is_serial and not by_pose:
        joint_kernel = kernel_of(record_at_joints(robot, finder), outputs, backend)
    kernel = kernel_of(recorded, outputs, backend)
    if recorded.joints and recorded.closure is None:
        joint_kernel = kernel
    inputs = _inputs_of(robot, kernel, joint_kernel)
    verified = is_trusted(recorded, inputs, finder)
    rank, status = recorded.factors.rank, recorded.status
    ranks = None
    if outputs == (StiffnessMatrix(),) and recorded.closure is None:
        at = sample_postures(finder).snapshot
        away = np.linalg.norm(at.reference_point - at.centre, axis=-1)
        if np.all(away < _NEAR * at.characteristic_length):  # ranks are decided about this point
            ranks = RecordedRanks.of(recorded)
    return CompiledRobot(rank, status, verified, kernel, robot, joint_kernel, ranks=ranks)


def _inputs_of(robot: Robot, kernel: Kernel, joint_kernel: Kernel | None) -> KernelInputs:
    joints = len(kernel.inputs) - len(robot.symbols) if kernel is joint_kernel else 0
    return KernelInputs(robot, joints)


# Generic poses must keep away from the tolerances that decide, by what poses may differ.
_STRICT = Tolerance(near_independence=1e-4, near_rigidity=1e-8)
_OTHER_SEED = 47
_NEAR = 5.0  # lengths
_NEARER = 4  # how often poses are drawn nearer to home
_SPUN = 0.2  # what coordinates that nothing determines are changed by [m, rad]


def is_trusted(recorded: RecordedRobot, inputs: KernelInputs, finder: PostureFinder) -> bool:
    """Whether generic poses of a robot are regular, and its record has been confirmed at them.

    Once at the poses at which it was recorded, and once at others: what a record takes for zero or
    for the same at its own samples must be so elsewhere. Both forms decide for themselves where
    they hold; where both do, they must give the same K, rank and status, else a `DisagreementError`
    is raised. Where the recorded closure arrives at none of the poses, it is asked at nearer ones.

    Without trust no pose of the robot is left to its record.
    """
    general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
    kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    at = [_agrees(kernel, general, inputs, finder, seed) for seed in (None, _OTHER_SEED)]
    return all(at)


def _depends_on_what_is_held(recorded: RecordedRobot, robot: Robot, finder: PostureFinder) -> bool:
    """Whether K differs between postures of one pose that differ in coordinates that are held.

    A rod that spins between spherical joints is held by nothing, and transmits the same. A passive
    joint that folds a chain of beams is held by nothing either, but K depends on the fold: there
    the record and the careful closure may be at different postures.
    """
    held = () if recorded.closure is None else recorded.closure.held
    if not held:
        return False
    posture = sample_postures(finder)
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
        if next(differences(K, rank, codes, there, free=AskedPoses.free), None) is not None:
            return True
    return False


def _agrees(
    kernel: Kernel,
    general: AtGeneralPoses,
    inputs: KernelInputs,
    finder: PostureFinder,
    seed: int | None,
) -> bool:
    """Whether a kernel gives what the wrench basis form gives, and nothing is in doubt."""
    robot = inputs.robot
    samples = list(parameter_samples(robot, seed).values())
    for nearer in range(_NEARER):
        posture = sample_postures(finder, seed, nearer)
        by_joints = robot.is_posed_by_joints
        given = posture.coordinates[0] if by_joints else posture.pose[:, robot.coordinate_places]
        values = ParameterValues(robot, np.reshape(samples, (len(samples), len(given))))
        rows = inputs.rows(_pose(robot, given), given, values)
        met = closes(kernel, kernel.evaluate(rows.rows)) & ~rows.missed
        if met.any():
            break
    else:
        return False
    answer = attempted(kernel, rows, general, 1)
    regular = np.zeros(len(given), dtype=bool)
    trusted = True
    for other, own in values.groups(met):
        part = _pose(robot, given[own])
        result = careful_stiffness(other, part)
        decided = ~(answer.guarded[own] | _doubtful(result))
        K = answer.values[StiffnessMatrix.name][own]
        rank, codes = answer.rank[own], answer.status_codes[own]
        for k, distance in differences(K, rank, codes, result, free=AskedPoses.free):
            if decided[k]:
                place = f"{robot.name!r} at {given[own[k]].tolist()}"
                for symbol, x in zip(robot.symbols, values.rows[:, own[k]].tolist(), strict=True):
                    place += f", {symbol} = {x!r}"
                raise DisagreementError(AskedPoses.opinions, distance, place)
            trusted = False
        regular[own] = ~_doubtful(careful_stiffness(other, part, tolerance=_STRICT))
    # One of them may be singular by chance: of an arm that is stretched out at home.
    return trusted and bool(2 * np.count_nonzero(met & ~regular) < np.count_nonzero(met))


def _pose(robot: Robot, given: np.ndarray) -> JointCoordinates | np.ndarray:
    return JointCoordinates(given) if robot.is_posed_by_joints else given


def _doubtful(result: RobotStiffness) -> np.ndarray:
    return (result.status_codes & int(Status.ILL_CONDITIONED)) != 0
