"""Robots and linkages compiled: kernels that the direct form confirms, and answers by both."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.answer_of_kernel import CompiledAnswer
from robostiff.analysis.compiled_answer import (
    AtGeneralPoses,
    RecordedRanks,
    attempted,
    decided_chunks,
    put_direct,
)
from robostiff.analysis.kernel_inputs import (
    InputRows,
    KernelInputs,
    LinkageInputs,
    ParameterValues,
    checked_outputs,
    with_parameters,
)
from robostiff.analysis.questions import Question
from robostiff.analysis.record_file import RecordFile
from robostiff.analysis.record_trust import (
    NEARER,
    check_derivatives,
    depends_on_what_is_held,
    is_trusted,
)
from robostiff.analysis.result import Stiffness
from robostiff.compiled import (
    Backend,
    Kernel,
    Output,
    Rates,
    SourceLanguage,
    StiffnessMatrix,
    kernel_of,
    source_of,
)
from robostiff.compiled.kernel import code_of
from robostiff.elastostatics import Status
from robostiff.errors import DisagreementError, InputError, NoAnswerError, OpenAtHomeError
from robostiff.kinematics import JointCoordinates, posture_finder
from robostiff.linkage import DrivenLinkage, Linkage
from robostiff.linkage.record import record_linkage
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.recorded import RecordedRobot, record_at_joints, record_robot, sample_postures
from robostiff.version import __version__

# Ranks are decided about a reference point that is nearer to the robot than so many lengths.
_NEAR = 5.0


#: Rank and status at a general pose, whether the record is verified, the kernel, that of joints,
#: and what decides ranks.
_Parts = tuple[int, Status, bool, Kernel, Kernel | None, RecordedRanks | None]
_PARTS = 6


@dataclass(frozen=True, repr=False)
class CompiledStiffness(AtGeneralPoses):
    """Stiffness that is recorded once and evaluated at millions of poses; picklable.

    Poses at which a check of the record fails are computed again by the direct form.

    Attributes
    ----------
    rank : int
        At a general pose.
    status : Status
        At a general pose.
    verified : bool
        Whether the record was found to agree at generic poses with the direct form; False where
        those are ill-conditioned, or recorded steps reach none of them, and every pose is then
        computed by that form.
    kernel : Kernel
        Of a robot it takes pose coordinates; those of the legs for an arm posed by its joints, and
        where the closure of the legs has no record: poses are then closed by iteration before. Of
        a linkage it takes the coordinates of the drives. Parameters follow.
    taken : KernelInputs or LinkageInputs
        How poses become inputs of the kernel.
    joint_kernel : Kernel or None
        Takes leg coordinates: of an arm, or it is the kernel itself.
    """

    kernel: Kernel
    taken: KernelInputs | LinkageInputs
    joint_kernel: Kernel | None = None

    @classmethod
    def kept(
        cls,
        about: tuple[Any, Sequence[Output]],
        backend: Backend,
        make: Callable[[], _Parts],
        taken: Callable[[Kernel, Kernel | None], KernelInputs | LinkageInputs],
    ) -> CompiledStiffness:
        """What is on disk about a robot or linkage and outputs; else it is made, and put there."""
        file = RecordFile.of(*about)
        read = () if file is None else file.read() or ()
        is_whole = len(read) == _PARTS and getattr(read[3], "outputs", None) == tuple(about[1])
        parts = cast("_Parts", read) if is_whole else make()
        rank, status, verified, kernel, joint_kernel, ranks = parts
        if is_whole:
            code, of_joints = code_of(backend), joint_kernel is kernel
            kernel, other = kernel.by(code), joint_kernel and joint_kernel.by(code)
            joint_kernel = kernel if of_joints else other
        elif file is not None:
            file.write(parts)
        inputs = taken(kernel, joint_kernel)
        return cls(rank, status, verified, kernel, inputs, joint_kernel, ranks=ranks)

    @property
    def subject(self) -> Robot | Linkage:
        """The robot or linkage; its symbols are the parameters of the kernel."""
        return self.taken.subject

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which may differ from pose to pose."""
        return tuple(symbol.name for symbol in self.subject.symbols)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates that the kernel takes."""
        return self.kernel.inputs[: len(self.kernel.inputs) - len(self.parameters)]

    @property
    def takes_joints(self) -> bool:
        """Whether it answers at coordinates of legs."""
        return self.joint_kernel is not None

    def __repr__(self) -> str:
        names = ", ".join(output.name for output in self.kernel.outputs)
        inputs = ", ".join(self.kernel.inputs)
        return (
            f"<CompiledStiffness of {self.subject.name!r}: {names} at {inputs}, "
            f"{self.kernel.operations} operations>"
        )

    def evaluate(
        self,
        pose: Any,
        *,
        parameters: Mapping[str, ArrayLike] | np.ndarray | None = None,
        threads: int | None = None,
        out: Mapping[str, np.ndarray] = MappingProxyType({}),
    ) -> CompiledAnswer:
        """Outputs, status and rank at many poses.

        Parameters
        ----------
        pose : (N, n) array, JointCoordinates, or mapping of str to (N,) arrays
            The robot's free pose coordinates, one pose a row [m, rad]; joint coordinates for a
            serial arm. Of a linkage the coordinates of its drives, in the order of `inputs` or by
            the names of the joints, (N, size) for a joint with several; those left out stay at
            home. Fastest where equal coordinates of all poses lie side by side in memory.
        parameters : mapping of str to a number or (N,) array, or (n, N) array, optional
            Values of parameters, in SI units; nominal where left out. Or an array (n, N) of all, in
            the order of `parameters`, which is not copied.
        threads : int, optional
            When left out, one for each 10^5 poses, at most as many as processors. No bit of the
            answer depends on it.
        out : mapping of str to (N, ...) arrays of floats, optional
            Filled with the outputs of these names, which is faster than new memory: at once where
            they are float64 with equal entries of all poses side by side in memory.

        Raises
        ------
        InputError
            When the poses or the parameters do not fit the robot, or an array the output.
        """
        kernel, inputs, values, question = self._asked(pose, parameters)
        shapes = {own.name: own.shape(kernel.space) for own in kernel.outputs}
        for name, array in out.items():
            shape = (len(inputs.missed), *shapes.get(name, ()))
            if name not in shapes or array.shape != shape or array.dtype.kind != "f":
                expected = f"floats {shape}" if name in shapes else ", ".join(shapes)
                raise InputError(f"array for {name!r}", got=array.shape, expected=expected)
        answer = attempted(kernel, inputs, self, threads, out)
        for subject, rows in values.groups(answer.guarded):
            try:
                result = Stiffness.of(question(subject, rows))
            except OpenAtHomeError:  # parameters of no robot: its legs reach no pose from home
                answer.status_codes[rows], answer.rank[rows] = int(Status.UNREACHABLE), -1
                for values_of_output in answer.values.values():
                    values_of_output[rows] = np.nan
            else:
                put_direct(answer, rows, result, self.kernel.outputs, self.rank)
        return answer

    def attempt(
        self,
        pose: Any,
        *,
        parameters: Mapping[str, ArrayLike] | np.ndarray | None = None,
        threads: int | None = None,
    ) -> CompiledAnswer:
        """As `evaluate`, but poses that are ``guarded`` are left to the caller.

        What stands there in the answer must not be used.
        """
        kernel, inputs, _, _ = self._asked(pose, parameters)
        return attempted(kernel, inputs, self, threads)

    def results(
        self, pose: Any, out: Mapping[str, np.ndarray]
    ) -> Iterator[tuple[slice, CompiledAnswer]]:
        """Answers by chunks of poses, values written into arrays (N, ...) of some outputs.

        Poses that are ``guarded`` are left to the caller.

        Raises InputError when the poses do not fit the robot.
        """
        kernel, inputs, _, _ = self._asked(pose, None)
        yield from decided_chunks(kernel, inputs, self, out)

    def source(self, language: SourceLanguage, name: str = "stiffness") -> str:
        """The kernel as a function of C99 or CUDA, which needs nothing of this package.

        It answers as `kernel` does: what it computes at poses of ``flags`` above 1 is not to be
        used, and poses that Newton steps do not reach at once have the flag 4.

        Raises
        ------
        InputError
            When `language` is none, or `name` no identifier.
        NoAnswerError
            When the record is not `verified`, or takes too many steps to be written out.

        Examples
        --------
        >>> import robostiff as rs
        >>> text = rs.compile(rs.load("3-puu")).source(rs.SourceLanguage.C)
        >>> [line for line in text.splitlines() if "void" in line]  # doctest: +ELLIPSIS
        ['void stiffness(long long n, const double *restrict in, ...)']
        """
        if not self.verified:
            raise NoAnswerError(f"no source of {self.subject.name!r}: its record is not verified")
        about = [
            f"Stiffness of {self.subject.name} (robostiff {__version__}), SI units, world axes,",
            f"about the reference point; rank {self.rank} where flags[i] is 0 or 1.",
        ]
        return source_of(self.kernel, language, name, about)

    def _asked(
        self, pose: Any, parameters: Mapping[str, ArrayLike] | np.ndarray | None
    ) -> tuple[Kernel, InputRows, ParameterValues[Any], Callable[[Any, np.ndarray], Question]]:
        """The kernel for such poses, its inputs, values of parameters, and the direct question."""
        kernel: Kernel = self.kernel
        taken: Any = self.taken  # which of the two takes such a pose
        pose = taken.read(pose)
        of_joints = self.joint_kernel
        if isinstance(pose, JointCoordinates):
            if of_joints is not None and of_joints is not kernel:
                kernel = of_joints
                taken = replace(taken, joints=len(kernel.inputs) - len(self.parameters))
        elif of_joints is kernel:
            self._check_poses()
        given = taken.checked(pose)
        values: ParameterValues[Any] = ParameterValues.of(self.subject, parameters, len(given))

        def question(subject: Any, rows: np.ndarray) -> Question:
            return taken.question(subject, pose, given[rows])

        return kernel, taken.rows(pose, given, values), values, question

    def _check_poses(self) -> None:
        """Raise where rates with parameters, of a record at joints, would be asked at poses."""
        for output in self.kernel.outputs:
            rate = output
            while isinstance(rate, Rates):
                if not set(rate.inputs).isdisjoint(self.parameters):
                    raise InputError(
                        f"{output.name} of {self.subject.name!r}",
                        got="poses of the platform",
                        expected="JointCoordinates, which stay while the parameter changes",
                    )
                rate = rate.of


def compile_stiffness(
    robot: Robot | Linkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    joints: Sequence[str] | None = None,
    backend: Backend = Backend.BEST,
) -> CompiledStiffness:
    """Record the stiffness of a robot or linkage once, for evaluation at millions of poses.

    Closure, frames, elimination of the passive joints and the sum over the legs become a list of
    several hundred to two thousand operations without branches, which is compiled to SIMD machine
    code or run by NumPy in chunks. Newton steps from home close loops and legs without closed form.
    Poses where a check of the record fails are computed again by the direct form.

    Parameters
    ----------
    robot : Robot or Linkage
        Symbols that are no parameters take their nominal values.
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``WorstDeflection()``, ``DisplacementUnder(wrench)``,
        ``EntryOf(output, place)``, ``Derivative(output, "x")``, ``Gradient(output, names)``.
    parameters : sequence of str
        Names of symbols that remain inputs, to be given with the poses. Working modes are those of
        the nominal values.
    joints : sequence of str, optional
        Of a linkage, the joints that drive it; all actuated ones when left out. The other ones
        follow, as in `network_at`.
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
    compiled = _COMPILERS.get(getattr(robot, "kind", ""))
    if compiled is None:
        raise InputError(
            "robot to compile",
            got=type(robot).__name__,
            expected="a Robot or a Linkage",
            hint='write compile(load("hexapod")), compile(load_linkage("four-bar.xml"))',
        )
    return compiled(robot, outputs, parameters, joints, backend)


def compile_robot(
    robot: Robot,
    outputs: Sequence[Output],
    parameters: Sequence[str],
    backend: Backend,
    most: int | None = None,
) -> CompiledStiffness:
    """As `compile_stiffness`; a record of more than `most` operations is a `NoAnswerError`."""
    robot.check_has_no_springs("kernel")
    outputs = checked_outputs(outputs)
    robot = with_parameters(robot, parameters, [c.value for c in ALL_COORDINATES])
    # Coordinates that leave the plane of a planar robot are those of home.
    inside = [ALL_COORDINATES[row] for row in robot.space.rows]
    robot = replace(robot, coordinates=tuple(c for c in robot.coordinates if c in inside))
    return CompiledStiffness.kept(
        (robot, outputs),
        backend,
        lambda: _recorded_robot(robot, outputs, backend, most),
        partial(_inputs, robot),
    )


def _inputs(robot: Robot, kernel: Kernel, joint_kernel: Kernel | None) -> KernelInputs:
    """How poses become inputs of a kernel, which may take coordinates of the legs."""
    joints = len(kernel.inputs) - len(robot.symbols) if kernel is joint_kernel else 0
    return KernelInputs(robot, joints)


def _recorded_robot(
    robot: Robot, outputs: tuple[Output, ...], backend: Backend, most: int | None
) -> _Parts:
    if most == 0:  # none is so short
        raise NoAnswerError(f"no record of {robot.name!r} on disk")
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder, most)
    if depends_on_what_is_held(recorded, robot, finder):
        recorded = record_at_joints(robot, finder, most)
    # A derivative may need more of the closure than its Newton steps give.
    if recorded.joints and not robot.is_posed_by_joints:
        check_derivatives(robot.name, recorded, outputs)
    joint_kernel = None
    names = {coordinate.value for coordinate in ALL_COORDINATES}
    by_pose = any(isinstance(x, Rates) and not names.isdisjoint(x.inputs) for x in outputs)
    if recorded.closure is not None and robot.is_serial and not by_pose:
        joint_kernel = kernel_of(record_at_joints(robot, finder), outputs, backend)
    kernel = kernel_of(recorded, outputs, backend)
    if recorded.joints and recorded.closure is None:
        joint_kernel = kernel
    verified = is_trusted(recorded, kernel, _inputs(robot, kernel, joint_kernel))
    ranks = None
    if outputs == (StiffnessMatrix(),) and recorded.closure is None:
        at = sample_postures(finder).snapshot
        away = np.linalg.norm(at.reference_point - at.centre, axis=-1)
        if np.all(away < _NEAR * at.characteristic_length):  # ranks are decided about this point
            ranks = RecordedRanks.of(recorded)
    return recorded.factors.rank, recorded.status, verified, kernel, joint_kernel, ranks


def compile_linkage(
    driven: DrivenLinkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    backend: Backend = Backend.BEST,
) -> CompiledStiffness:
    """As `compile_stiffness`, of a linkage that some joints drive.

    Wrenches that circulate in the loops are eliminated by the passive joints, and K follows from
    the energy of the rest.
    """
    return CompiledStiffness.kept(
        (driven, outputs),
        backend,
        lambda: _recorded_linkage(driven, outputs, backend),
        lambda *_: LinkageInputs(driven),
    )


def _recorded_linkage(driven: DrivenLinkage, outputs: Sequence[Output], backend: Backend) -> _Parts:
    recorded, undetermined, nearer = _record_of(driven)
    check_derivatives(driven.part.name, recorded, outputs)
    kernel, taken = kernel_of(recorded, outputs, backend), LinkageInputs(driven)
    try:
        verified = is_trusted(recorded, kernel, taken, nearer)
    except DisagreementError:
        if undetermined:
            raise _undetermined(driven, undetermined) from None
        raise
    return recorded.factors.rank, recorded.status, verified, kernel, None, None


def _record_of(driven: DrivenLinkage) -> tuple[RecordedRobot, tuple[str, ...], int]:
    """The record, joints left undetermined, and how near to home the samples are.

    They are as near as home's surroundings are regular.
    """
    for nearer in range(NEARER):
        samples = driven.samples(nearer=nearer)
        recorded, undetermined = record_linkage(driven, samples)
        if recorded is not None:
            return recorded, undetermined, nearer
        if undetermined:
            raise _undetermined(driven, undetermined)
    raise InputError(
        f"home of {driven.part.name!r}",
        got="a configuration in which assembly modes meet",
        expected="a regular home for a kernel",
        hint="give another home, or use network_at(linkage, ...) pose by pose",
    )


def _undetermined(driven: DrivenLinkage, names: Sequence[str]) -> InputError:
    return InputError(
        f"driven joints of {driven.part.name!r}",
        got=f"{', '.join(driven.drives)}, which leave {', '.join(names)} undetermined",
        expected="joints that decide the configuration",
        hint="add them, joints=(...), or use network_at(linkage, ...) pose by pose",
    )


def _compiled_robot(
    robot: Robot, outputs: Any, parameters: Sequence[str], joints: Any, backend: Backend
) -> CompiledStiffness:
    if joints is not None:
        raise InputError(
            f"driven joints of {robot.name!r}",
            got=joints,
            expected="none: a robot with legs takes poses",
        )
    return compile_robot(robot, outputs, parameters, backend)


def _compiled_linkage(
    linkage: Linkage, outputs: Any, parameters: Sequence[str], joints: Any, backend: Backend
) -> CompiledStiffness:
    names = [name for c in linkage.connections for name in c.coordinate_names]
    driven = DrivenLinkage.of(with_parameters(linkage, parameters, names), joints)
    return compile_linkage(driven, checked_outputs(outputs), backend)


_COMPILERS = {Robot.kind: _compiled_robot, Linkage.kind: _compiled_linkage}
