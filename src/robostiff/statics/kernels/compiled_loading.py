"""A robot under load, recorded once and evaluated at many poses and wrenches."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from robostiff.analysis.guarded_values import AtGeneralPoses, checked_results
from robostiff.analysis.kernel_inputs import KernelInputs, ParameterValues, with_parameters
from robostiff.compiled import ArrayCode, Backend, Kernel, MachineCode, StiffnessMatrix, unpack
from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.kernel import code_of, whole_threads
from robostiff.elastostatics import Status
from robostiff.errors import DisagreementError, InputError, NoAnswerError
from robostiff.kinematics import JointCoordinates, Pose, PostureFinder, posture_finder
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.record import Program, Record
from robostiff.recorded import CLOSED, parameter_samples, record_robot, sample_postures
from robostiff.statics.beam_bowing import Beams, Bowing
from robostiff.statics.equilibrium import equilibrium, postures_of, wrenches_of
from robostiff.statics.given_loads import acting_gravity
from robostiff.statics.kernels.elimination import RigidLegError
from robostiff.statics.kernels.loading import RecordedLoading, record_loading
from robostiff.statics.problem import EquilibriumProblem, LoadCase
from robostiff.statics.result import Equilibria
from robostiff.statics.status import WITHOUT_STIFFNESS, EquilibriumStatus

_BOWING = Bowing()
# Operations of a step beyond which compiling takes longer than NumPy needs for many poses.
_LONGEST = 30_000
_CHUNK = 8192
# Relative to the diagonals of K: more than rounding and the last Newton step make.
_AGREES = 1e-8
# Of the largest stiffness of the platform: none.
_FREE = 1e-10
# Postures at which struts are asked how soon they buckle.
_POSTURES, _SPREAD = 16, 0.3
_SUBJECT = "K under load by record and by equilibrium"


@dataclass(frozen=True, repr=False)
class LoadedAnswer:
    """Equilibria of a robot at N poses under N wrenches.

    Attributes
    ----------
    K_sym : (N, r, r) array
        Hessian of the energy about the point that moves along [N/m, N, N m]; not a number where
        there is no answer.
    displacement : (N, r) array
        Of the reference point and rotation vector, from the unloaded posture [m, rad].
    stable : (N,) array of bool
    status_codes : (N,) array of uint16
        See `EquilibriumStatus`.
    guarded : (N,) array of bool
        What was computed again by `equilibrium`.
    wrench : (N, r) array
        As given [N, N m].
    """

    K_sym: np.ndarray
    displacement: np.ndarray
    stable: np.ndarray
    status_codes: np.ndarray
    guarded: np.ndarray
    wrench: np.ndarray

    @property
    def K(self) -> np.ndarray:
        """Rate of the wrench (N, r, r): `K_sym` and the antisymmetric part of moments."""
        K = self.K_sym.copy()
        if K.shape[-1] == 6:
            x, y, z = 0.5 * self.wrench[:, 3:].T
            for (i, j), part in {(3, 4): z, (4, 5): x, (5, 3): y}.items():
                K[:, i, j] += part
                K[:, j, i] -= part
        return K

    @property
    def answered(self) -> np.ndarray:
        """Where there is an equilibrium (N,)."""
        return (self.status_codes & int(WITHOUT_STIFFNESS)) == 0

    @property
    def status(self) -> EquilibriumStatus:
        """Everything that happened to any of them."""
        return EquilibriumStatus(int(np.bitwise_or.reduce(self.status_codes, initial=0)))

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were computed again."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0

    def __repr__(self) -> str:
        return (
            f"<LoadedAnswer of {len(self.stable)} poses: {self.guarded_share:.2%} recomputed, "
            f"status {self.status}>"
        )


@dataclass(frozen=True, repr=False)
class CompiledLoading:
    """A robot under load whose equilibria are recorded once, for millions of poses; picklable.

    Attributes
    ----------
    robot : Robot
        Its symbols are the parameters of the kernel.
    kernel : Kernel
        Takes the coordinates of the posture, the wrench, then the parameters.
    closure : Kernel or None
        From pose coordinates to those of the legs, where the kernel takes these.
    general : AtGeneralPoses
        Without load.
    status : EquilibriumStatus
        At a general pose.
    beams : Bowing or Linear
    """

    robot: Robot
    kernel: Kernel
    closure: Kernel | None
    general: AtGeneralPoses
    status: EquilibriumStatus
    beams: Beams

    @property
    def verified(self) -> bool:
        """Whether the record was confirmed at generic poses; otherwise none is left to it."""
        return self.general.verified

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which may differ from pose to pose."""
        return tuple(str(symbol) for symbol in self.robot.symbols)

    def __repr__(self) -> str:
        inputs = ", ".join((self.closure or self.kernel).inputs[:12])
        return (
            f"<CompiledLoading of {self.robot.name!r}: equilibrium at {inputs}, "
            f"{self.kernel.operations} operations>"
        )

    def evaluate(
        self,
        pose: Pose,
        wrench: ArrayLike,
        *,
        parameters: Mapping[str, ArrayLike] | None = None,
        threads: int = 1,
    ) -> LoadedAnswer:
        """Equilibria at many poses; where a check fails, `equilibrium` computes them.

        Parameters
        ----------
        pose : (N, n) array or JointCoordinates
            Unloaded postures, as `rs.compile` takes them.
        wrench : (r,) or (N, r) array
            On the platform about its reference point, world axes [N, N m].
        parameters : mapping of str to a number or (N,) array, optional
            Values of parameters, in SI units; nominal where left out.
        threads : int

        Raises
        ------
        InputError
            When poses, wrenches or parameters do not fit the robot.
        """
        threads = whole_threads(threads)
        robot, space = self.robot, self.robot.space
        by_joints = isinstance(pose, JointCoordinates)
        given = KernelInputs(robot, self._joints).checked(pose)
        count = len(given)
        F = wrenches_of("wrench", wrench, space)
        if F.ndim == 2 and len(F) not in (1, count):
            raise InputError("wrench", got=f"{len(F)} wrenches", expected=f"one, or {count}")
        F = np.broadcast_to(F, (count, space.size))
        values = ParameterValues.of(robot, parameters, count)
        answer = LoadedAnswer(
            K_sym=np.moveaxis(np.empty((space.size, space.size, count)), -1, 0),
            displacement=np.empty((count, space.size)),
            stable=np.ones(count, dtype=bool),
            status_codes=np.empty(count, dtype=np.uint16),
            guarded=np.empty(count, dtype=bool),
            wrench=F,
        )

        def fill(part: slice) -> None:
            for start in range(part.start, part.stop, _CHUNK):
                own = slice(start, min(start + _CHUNK, part.stop))
                self._fill(given[own], F[own], values.rows[:, own], own, answer)

        share = max(1, -(-count // (_CHUNK * threads))) * _CHUNK
        parts = [slice(one, min(one + share, count)) for one in range(0, count, share)]
        if len(parts) <= 1:
            fill(slice(0, count))
        else:
            with ThreadPoolExecutor(len(parts)) as pool:
                list(pool.map(fill, parts))
        for other, rows in values.groups(answer.guarded):
            some = JointCoordinates(given[rows]) if by_joints else given[rows]
            self._compute_again(other, some, F[rows], rows, answer)
        return answer

    @property
    def _joints(self) -> int:
        if not self.robot.is_posed_by_joints:
            return 0
        return self.robot.legs[0].chain.size

    def _fill(
        self,
        given: np.ndarray,
        F: np.ndarray,
        parameters: np.ndarray,
        where: slice,
        answer: LoadedAnswer,
    ) -> None:
        """Results of the kernel at a chunk of poses."""
        count, r = len(given), self.robot.space.size
        posture, loose = given.T, np.zeros(count, dtype=bool)
        if self.closure is not None:
            found = self.closure.evaluate(np.concatenate([given.T, parameters]))
            posture = found[:-2]
            loose = ~((found[-2] < CLOSED) & (found[-1] > 0))
        results = self.kernel.evaluate(np.concatenate([posture, F.T, parameters]))
        missed = np.zeros(count, dtype=bool)
        checked = checked_results(self.kernel, results, missed, loose, self.general)
        unpack(checked.rows["K"], answer.K_sym[where])
        rows = r * (r + 1) // 2
        # Equilibrium is only as good as all that it was computed from.
        unsure = ~np.isfinite(results[: rows + 7]).all(axis=0)
        place = np.where(
            unsure, np.array([0.0, 0, 0, 1, 0, 0, 0])[:, None], results[rows : rows + 7]
        )
        answer.displacement[where] = displacement_of(place)[:, list(self.robot.space.rows)]
        unreachable = (checked.status_codes & int(Status.UNREACHABLE)) != 0
        answer.displacement[where][unreachable] = np.nan
        answer.stable[where] = ~unreachable
        codes = checked.status_codes.astype(np.uint16)
        kept = np.uint16(int(Status.UNREACHABLE | Status.BEYOND_LIMITS))
        general = np.where(unreachable, 0, int(self.status)).astype(np.uint16)
        answer.status_codes[where] = (codes & kept) | general
        answer.guarded[where] = checked.guarded | (unsure & ~unreachable)

    def _compute_again(
        self, robot: Robot, pose: Pose, F: np.ndarray, rows: np.ndarray, answer: LoadedAnswer
    ) -> None:
        found = _equilibria(robot, pose, F, self.beams)
        K = found.K.filled(np.nan)
        answer.K_sym[rows] = 0.5 * (K + np.swapaxes(K, -1, -2))
        answer.displacement[rows] = found.displacement.filled(np.nan)
        answer.stable[rows], answer.status_codes[rows] = found.stable, found.status_codes


def _equilibria(robot: Robot, pose: Pose, F: np.ndarray, beams: Beams) -> Equilibria:
    found = equilibrium(robot, pose, F, beams=beams)
    if not isinstance(found, Equilibria):
        raise TypeError("a batch of poses gives equilibria")
    return found


def displacement_of(place: np.ndarray) -> np.ndarray:
    """Shift and rotation vector (N, 6) of rows of shifts and quaternions (7, N), scalar first."""
    turn = Rotation.from_quat(place[[4, 5, 6, 3]].T).as_rotvec()
    return np.concatenate([place[:3].T, turn], axis=1)


def compile_loaded(
    robot: Robot,
    *,
    parameters: Sequence[str] = (),
    beams: Beams = _BOWING,
    backend: Backend = Backend.BEST,
) -> CompiledLoading:
    """Record the equilibrium of a robot under a wrench once, for many poses and wrenches.

    The unloaded posture, the Newton steps from it to equilibrium, and K there become a list of
    operations without branches; legs that carry a force along a line alone enter as springs between
    two points. At every pose the record checks that its steps contract and arrive, that no leg and
    no motion of the platform is near a critical load, and that the posture is regular; what fails
    is computed by `equilibrium`.

    Parameters
    ----------
    robot : Robot
        Symbols that are no parameters take their nominal values.
    parameters : sequence of str
        Names of symbols that stay open, to be given with the poses.
    beams : Bowing or Linear
        As for `equilibrium`.
    backend : Backend
        As for `compile`. NumPy runs steps of more than 30,000 operations.

    Returns
    -------
    CompiledLoading

    Raises
    ------
    InputError
        When the robot has a flexible platform, weighs something under its own gravity, or a
        parameter is no symbol of it.
    NoAnswerError
        When the platform has free motions at every pose, or a leg is rigid in some direction.
    DisagreementError
        When the record and `equilibrium` give different answers at a generic pose.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("gough-stewart-b")
    >>> fast = rs.compile_loaded(robot)
    >>> poses = np.zeros((3, 6)) + [0, 0, 0.5, 0, 0, 0.1]
    >>> answer = fast.evaluate(poses, [0, 0, -1e5, 0, 0, 0])
    >>> K = rs.equilibrium(robot, poses[0], [0, 0, -1e5, 0, 0, 0]).K
    >>> bool(np.allclose(answer.K[0], K, rtol=1e-9, atol=1e-9 * K.max())), answer.stable.tolist()
    (True, [True, True, True])
    """
    if not isinstance(robot, Robot):
        raise InputError(
            "robot to compile under load",
            got=type(robot).__name__,
            expected="a Robot",
            hint='write compile_loaded(load("hexapod"))',
        )
    robot.check_platform_is_rigid("kernel under load")
    if np.any(acting_gravity(robot.numeric, None)):
        raise InputError(
            f"kernel under load of {robot.name!r}",
            got="a robot under its own gravity",
            expected="a wrench on the platform alone",
            hint="leave gravity out of the model, or use equilibrium, which has weights",
        )
    code = code_of(backend)
    taken = [*(c.value for c in ALL_COORDINATES), *robot.space.wrench_order]
    robot = with_parameters(robot, parameters, taken)
    finder = posture_finder(robot.numeric)
    recorded = record_robot(robot, finder)
    problems = _problems(finder, beams)
    force = _small_force(robot, problems[0])
    try:
        loading = record_loading(robot, finder, problems, force, by_pose=not recorded.joints)
    except RigidLegError as error:
        raise NoAnswerError(
            f"no kernel under load of {robot.name!r}: a leg is rigid in some direction; give its "
            "parts a stiffness"
        ) from error

    def chosen(program: Program) -> MachineCode | ArrayCode:
        return code(program) if program.operations <= _LONGEST else ArrayCode(program)

    kernel = _kernel(robot, loading, chosen)
    closure = None
    if recorded.closure is not None:
        names = recorded.joints
        record = Record({name: np.array([1.0]) for name in names})
        joints = Program.of(record, [record.input(name) for name in names])
        closure = Kernel(
            recorded.closure.inputs,
            (),
            ("open", "mode"),
            robot.space,
            ClosedCode.of(recorded.closure, joints, code),
        )
    general = AtGeneralPoses(loading.rank, loading.status, verified=True)
    found = CompiledLoading(robot, kernel, closure, general, EquilibriumStatus.OK, beams)
    return _confirmed(found, finder, force)


def _kernel(robot: Robot, loading: RecordedLoading, code: Callable[[Program], Any]) -> Kernel:
    return Kernel(
        inputs=loading.inputs,
        outputs=(StiffnessMatrix(),),
        checks=(*loading.checks, "open", "mode"),
        space=robot.space,
        code=ClosedCode.of(loading, loading.arrival, code),
    )


def _problems(finder: PostureFinder, beams: Beams) -> list[EquilibriumProblem]:
    """The robot in numbers at home, and at postures around it."""
    robot = finder.robot
    home = postures_of(robot, None, None).question(0, None, None, None, beams)
    found = [home.problem]
    if robot.is_posed_by_joints:
        return found
    places = robot.coordinate_places
    random = np.random.default_rng(20111)
    size = np.where(np.array(places) < 3, finder.length, 1.5)
    shifts = _SPREAD * size * random.uniform(-1, 1, (4 * _POSTURES, len(places)))
    around = postures_of(robot, finder.home_pose[places] + shifts, None)
    posture = around.posture
    if posture is None:
        return found
    reached = np.flatnonzero(posture.reached & posture.within_limits)[:_POSTURES]
    for k in reached:
        own = around.question(int(k), None, None, None, beams)
        found.append(own.problem)
    return found


def _small_force(robot: Robot, problem: EquilibriumProblem) -> float:
    """Under which the platform moves by about a thousandth of the robot's length [N].

    Raises
    ------
    NoAnswerError
        When the platform is not held in all directions, or is rigid.
    """
    nothing = np.zeros(problem.size)
    known = problem.linearised(problem.unloaded, LoadCase(nothing, nothing, 0.0, 0.0), 0.0)
    if known.rigid:
        raise NoAnswerError(
            f"no kernel under load of {robot.name!r}: a leg is rigid in some direction; give its "
            "parts a stiffness"
        )
    values = np.linalg.eigvalsh(known.K / np.outer(problem.scale, problem.scale))
    if values[0] <= _FREE * values[-1]:
        raise NoAnswerError(
            f"no kernel under load of {robot.name!r}: its platform has free motions, in which a "
            "wrench has no equilibrium; ask rs.equilibrium, wrench by wrench"
        )
    return 1e-3 * problem.length * float(values[0])


def _confirmed(found: CompiledLoading, finder: PostureFinder, force: float) -> CompiledLoading:
    """The same, once it has been found to agree with equilibria at generic poses.

    Raises
    ------
    DisagreementError
        When it gives something else.
    """
    robot = found.robot
    posture = sample_postures(finder.robot, finder, 1873)
    by_joints = robot.is_posed_by_joints
    given = posture.coordinates[0] if by_joints else posture.pose[:, robot.coordinate_places]
    pose = JointCoordinates(given) if by_joints else given
    random = np.random.default_rng(5)
    rows = np.array(robot.space.rows)
    F = (
        force
        * np.where(rows < 3, 1.0, finder.length)
        * random.uniform(-1, 1, (len(given), len(rows)))
    )
    F[0] = 0.0
    values = parameter_samples(robot, 1873)
    slow = _in_arrays(found)
    answer = slow.evaluate(pose, F, parameters=values)
    if np.all(answer.guarded):
        return replace(found, general=replace(found.general, verified=False))
    parameter_rows = ParameterValues(
        robot, np.reshape(list(values.values()), (len(values), len(given)))
    )
    status = EquilibriumStatus.OK
    for other, own in parameter_rows.groups(~answer.guarded):
        part = JointCoordinates(given[own]) if by_joints else given[own]
        sure = _equilibria(other, part, F[own], found.beams)
        for k, one in zip(own, sure, strict=True):
            where = f"{robot.name!r} at {given[k].tolist()} under {F[k].tolist()}"
            if not one.has_answer:
                raise DisagreementError(_SUBJECT, f"({one.status} against an answer)", where)
            size = np.sqrt(np.diag(one.K))
            off = float(np.max(np.abs(answer.K[k] - one.K) / np.outer(size, size)))
            if not off <= _AGREES:
                raise DisagreementError(_SUBJECT, off, where)
            status = one.status & ~EquilibriumStatus.BEYOND_LIMITS
    return replace(found, status=status)


def _in_arrays(found: CompiledLoading) -> CompiledLoading:
    """The same without machine code, for few poses."""

    def plain(kernel: Kernel | None) -> Any:
        if kernel is None or not isinstance(kernel.code, ClosedCode):
            return kernel
        step, last = kernel.code.few
        return replace(kernel, code=replace(kernel.code, whole=None, step=step, last=last))

    return replace(found, kernel=plain(found.kernel), closure=plain(found.closure))
