"""Robots and linkages compiled: kernels that the direct form confirms, and answers by both."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import (
    AtGeneralPoses,
    CompiledAnswer,
    InputRows,
    answer_of_kernel,
    answers_in_chunks,
    closes,
)
from robostiff.analysis.kernel_inputs import (
    KernelInputs,
    ParameterValues,
    Recordable,
    RecordedParts,
    checked_outputs,
    recordable,
)
from robostiff.analysis.questions import function_for
from robostiff.analysis.record_file import RecordFile
from robostiff.analysis.result import Stiffness
from robostiff.compiled import (
    ArrayCode,
    Backend,
    Kernel,
    MachineCode,
    Output,
    Rates,
    SourceLanguage,
    StiffnessMatrix,
    TotalMass,
    source_of,
)
from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.codes import chunks_of
from robostiff.compiled.kernel import code_of
from robostiff.elastostatics import Status
from robostiff.errors import InputError, NoAnswerError, OpenAtHomeError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics import JointCoordinates, posture_finder
from robostiff.record import Flag
from robostiff.version import __version__

if TYPE_CHECKING:
    from robostiff.linkage import Linkage
    from robostiff.model import Robot
    from robostiff.model.cable import CableRobot

_PARTS = 6
_WAYS = 1024  # to so many poses at once are looked at
# Flags of a pose at which a kernel is right, limits beside.
_RIGHT = (0.0, float(Flag.BEYOND_LIMITS))


@frozen(repr=False)
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
    taken : Recordable
        The machine, and how poses become inputs of the kernel.
    joint_kernel : Kernel or None
        Takes leg coordinates: of an arm, or it is the kernel itself.
    """

    kernel: Kernel
    taken: Recordable
    joint_kernel: Kernel | None = None

    @classmethod
    def of(
        cls,
        taken: Recordable,
        outputs: tuple[Output, ...] = (StiffnessMatrix(),),
        backend: Backend = Backend.BEST,
        most: int | None = None,
    ) -> Self:
        """What is on disk about a machine and outputs; else it is recorded, and put there.

        A NoAnswerError where that would take more than `most` operations.
        """
        file = RecordFile.of(taken, outputs)
        read = () if file is None else file.read() or ()
        is_whole = len(read) == _PARTS and getattr(read[3], "outputs", None) == outputs
        if not is_whole and most == 0:  # no record is so short
            raise NoAnswerError(f"no record of {taken.subject.name!r} on disk")
        if not is_whole:
            from robostiff.analysis.recording import recorded_parts

            read = recorded_parts(taken, outputs, backend, most)
        rank, status, verified, kernel, joint_kernel, ranks = cast("RecordedParts", read)
        if is_whole:
            code, of_joints = code_of(backend), joint_kernel is kernel
            kernel, other = kernel.by(code), joint_kernel and joint_kernel.by(code)
            joint_kernel = kernel if of_joints else other
        elif file is not None:
            file.write(read)
        taken = taken.taken_by(kernel, joint_kernel)
        return cls(rank, status, verified, kernel, taken, joint_kernel, ranks=ranks)

    def by(self, code: type[MachineCode] | type[ArrayCode]) -> Self:
        """The same for poses, run by another code."""
        return replace(self, kernel=self.kernel.by(code))

    @property
    def subject(self) -> Any:
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
        again: bool = True,
    ) -> CompiledAnswer:
        """Outputs, status and rank at many poses, or at one.

        Parameters
        ----------
        pose : (N, n) or (n,) array, JointCoordinates, or mapping of str to (N,) arrays
            The robot's free pose coordinates, one pose a row [m, rad]; joint coordinates for a
            serial arm. Of a linkage the coordinates of its drives, in the order of `inputs` or by
            the names of the joints, (N, size) for a joint with several; those left out stay at
            home. Fastest where equal coordinates of all poses lie side by side in memory. Of one
            pose alone, answers are without the axis of N.
        parameters : mapping of str to a number or (N,) array, or (n, N) array, optional
            Values of parameters, in SI units; nominal where left out. Or an array (n, N) of all, in
            the order of `parameters`, which is not copied.
        threads : int, optional
            When left out, one for each 10^5 poses, at most as many as processors. No bit of the
            answer depends on it.
        out : mapping of str to (N, ...) arrays of floats, optional
            Filled with the outputs of these names, which is faster than new memory: at once where
            they are float64 with equal entries of all poses side by side in memory.
        again : bool
            Whether ``guarded`` poses are computed again by the direct form. Otherwise what stands
            there in the answer must not be used.

        Raises
        ------
        InputError
            When the poses or the parameters do not fit the robot, or an array the output.
        """
        kernel, inputs, values, direct, is_one = self._request(pose, parameters)
        if is_one:
            out = {name: np.asarray(array)[None] for name, array in out.items()}
        shapes = {own.name: own.shape(kernel.space) for own in kernel.outputs}
        for name, array in out.items():
            shape = (len(inputs.missed), *shapes.get(name, ()))
            if name not in shapes or array.shape != shape or array.dtype.kind != "f":
                expected = f"floats {shape}" if name in shapes else ", ".join(shapes)
                raise InputError(f"array for {name!r}", got=array.shape, expected=expected)
        answer = answer_of_kernel(kernel, inputs, self, threads, out)
        self._find_lost(kernel, answer, inputs.rows)
        for subject, rows in values.groups(answer.guarded) if again else ():
            try:
                result = direct(subject, rows)
            except OpenAtHomeError:  # parameters of no robot: its legs reach no pose from home
                answer.put_out_of_reach(rows)
            else:
                _put_direct(answer, rows, result, self.kernel.outputs, self.rank)
        return answer[0] if is_one else answer

    def at_one(self, inputs: list[float], by_joints: bool = False) -> CompiledAnswer | None:
        """What a kernel of K gives at one pose by plain inputs; None where a check of it fails."""
        kernel = self.joint_kernel if by_joints else self.kernel
        if kernel is None or not self.verified or len(kernel.inputs) != len(inputs):
            return None
        results = kernel.at_one(inputs)
        flags, n = results[len(results) - len(kernel.checks)], kernel.space.size
        if flags not in _RIGHT or not (len(kernel.checks) == 1 or closes(kernel, results)):
            return None
        status = int(self.status) | (int(Status.BEYOND_LIMITS) if flags else 0)
        return CompiledAnswer(
            values={StiffnessMatrix.name: np.array(results[: n * n]).reshape(n, n)},
            status_codes=np.array(status, dtype=np.uint16),
            rank=np.array(self.rank, dtype=np.int8),
            guarded=np.array(False),
        )

    def results(
        self, pose: Any, out: Mapping[str, np.ndarray]
    ) -> Iterator[tuple[slice, CompiledAnswer]]:
        """Answers by chunks of poses, values written into arrays (N, ...) of some outputs.

        Poses that are ``guarded`` are left to the caller.

        Raises InputError when the poses do not fit the robot.
        """
        kernel, inputs, *_ = self._request(pose, None)
        for where, answer in answers_in_chunks(kernel, inputs, self, out):
            self._find_lost(kernel, answer, inputs.rows[:, where])
            yield where, answer

    def _find_lost(self, kernel: Kernel, answer: CompiledAnswer, inputs: np.ndarray) -> None:
        """Decide guarded poses, inputs (inputs, N), to which the ways of a robot end, in place."""
        code, of_robot = kernel.code, isinstance(self.taken, KernelInputs) and not self.parameters
        if self.verified and of_robot and isinstance(code, ClosedCode) and code.home:
            rows = np.flatnonzero(answer.guarded)
            for part in chunks_of(slice(0, rows.size), _WAYS):
                own = np.ascontiguousarray(inputs[:, rows[part]])
                end = posture_finder(self.subject).ways_end(own.T, *code.ways(own))
                answer.put_out_of_reach(rows[part][end])

    def source(self, language: SourceLanguage, name: str = "stiffness") -> str:
        """The kernel as a function of C99 or CUDA, which needs nothing of this package.

        It answers as `kernel` does: what it computes at poses of ``flags & 62`` is not to be used,
        and poses that Newton steps do not reach at once have the flag 4.

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

    def _request(
        self, pose: Any, parameters: Mapping[str, ArrayLike] | np.ndarray | None
    ) -> tuple[Kernel, InputRows, ParameterValues[Any], Callable[..., Stiffness], bool]:
        """The kernel for such poses, its inputs, values of parameters, and the direct form.

        Last, whether it is one pose that was given without an axis of poses.
        """
        kernel, taken, of_joints = self.kernel, self.taken, self.joint_kernel
        pose = taken.read(pose)
        if isinstance(pose, JointCoordinates):
            if of_joints is not None and of_joints is not kernel:
                kernel, taken = of_joints, taken.taken_by(of_joints, of_joints)
        elif of_joints is kernel:  # rates with parameters, of a record at joints, need these
            for output in kernel.outputs:
                rate = output
                while isinstance(rate, Rates):
                    if not set(rate.inputs).isdisjoint(self.parameters):
                        raise InputError(
                            f"{output.name} of {self.subject.name!r}",
                            got=Words("poses of the platform"),
                            expected="JointCoordinates, which stay while the parameter changes",
                        )
                    rate = rate.of
        numbers = taken.numbers_of(pose)
        given = np.atleast_2d(numbers)
        values: ParameterValues[Any] = ParameterValues.of(self.subject, parameters, len(given))

        def direct(subject: Any, rows: np.ndarray) -> Stiffness:
            return taken.direct(subject, pose, given[rows])

        return kernel, taken.rows(pose, given, values), values, direct, numbers.ndim == 1


def _put_direct(
    answer: CompiledAnswer,
    rows: np.ndarray,
    result: Stiffness,
    outputs: Sequence[Output],
    rank: int,
) -> None:
    """Write what the direct form gives at some poses into an answer of a general `rank`."""
    from robostiff.analysis.measures import values_of

    answer.status_codes[rows] = result.status_codes
    answer.rank[rows] = result.rank
    for output in outputs:
        if isinstance(output, TotalMass):
            continue  # no check of the record concerns it
        if isinstance(output, Rates):
            # Derivatives are not recomputed: the loss of digits is reported instead. Where
            # the rank is another, K jumps.
            answer.status_codes[rows] |= np.uint16(Status.ILL_CONDITIONED)
            jumps = ~result.answered | (result.rank != rank)
            answer.values[output.name][rows[jumps]] = np.nan
            continue
        values, of_load = values_of(output, result)
        answer.values[output.name][rows] = values
        answer.status_codes[rows] |= of_load


def compile_stiffness(
    robot: Robot | Linkage | CableRobot,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    parameters: Sequence[str] = (),
    joints: Sequence[str] | None = None,
    backend: Backend = Backend.BEST,
) -> CompiledStiffness:
    """Record the stiffness of a machine once, for evaluation at millions of poses.

    Closure, frames, elimination of the passive joints and the sum over the legs become a list of
    several hundred to two thousand operations without branches, which is compiled to SIMD machine
    code or run by NumPy in chunks. Newton steps from home close loops and legs without closed form.
    Poses where a check of the record fails are computed again by the direct form.

    Parameters
    ----------
    robot : Robot, Linkage or CableRobot
        Symbols that are no parameters take their nominal values.
    outputs : sequence of Output
        ``StiffnessMatrix()``, ``ComplianceMatrix()``, ``DeflectionUnder(wrench)``,
        ``PrincipalStiffness()``, ``WorstDeflection()``, ``DisplacementUnder(wrench)``,
        ``EntryOf(output, place)``, ``Derivative(output, "x")``, ``Gradient(output, names)``; of a
        cable robot ``TensionsOf(names)``, and nothing under a wrench.
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
    record = function_for(recordable, robot)
    return CompiledStiffness.of(
        record(robot, parameters, joints), checked_outputs(outputs), backend
    )
