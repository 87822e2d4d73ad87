"""From a robot to its kernel under load, confirmed at generic poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Any, cast

import numpy as np

from robostiff.analysis.compiled_answer import AtGeneralPoses
from robostiff.analysis.kernel_inputs import ParameterValues, with_parameters
from robostiff.analysis.record_file import RecordFile
from robostiff.analysis.recording import depends_on_posture
from robostiff.compiled import ArrayCode, Backend, Kernel, StiffnessMatrix
from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.kernel import code_of
from robostiff.elastostatics import Status
from robostiff.errors import DisagreementError, InputError, NoAnswerError
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, Posture, PostureFinder, posture_finder
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.model.entries import formulas
from robostiff.record import Program, Record
from robostiff.recorded import parameter_samples, sample_postures
from robostiff.spatial import as_floats
from robostiff.statics.chains.beam_bowing import Beams, Bowing
from robostiff.statics.equations.stability import meets_stiffness
from robostiff.statics.kernels.compiled_loading import CompiledLoading
from robostiff.statics.kernels.elimination import RigidLegError
from robostiff.statics.kernels.leg import Site
from robostiff.statics.kernels.loaded_robot import record_loading
from robostiff.statics.kernels.strut import struts_among
from robostiff.statics.loading.given_loads import (
    Acting,
    Gravity,
    Loads,
    StandingLoads,
    comparable_gravity,
)
from robostiff.statics.loading.loaded_posture import LoadedPosture, postures_of
from robostiff.statics.result import Equilibrium
from robostiff.statics.solution import solve

_BOWING = Bowing()
# Relative to the diagonals of K: more than rounding and the last Newton step make.
_AGREES = 1e-8
# Postures at which the buckling loads of struts are computed; of so many that are drawn without
# and with struts, whose lengths differ.
_POSTURES, _DRAWN, _DRAWN_OF_STRUTS, _SPREAD = 16, 64, 1024, 0.3
# Last fields of `CompiledLoading`, which are kept on disk.
_PARTS = 6
_SUBJECT = "K under load by record and by equilibrium"


def compile_loaded(
    robot: Robot,
    *,
    parameters: Sequence[str] = (),
    loads: Loads | None = None,
    gravity: Gravity = None,
    preload: Mapping[str, float] | None = None,
    beams: Beams = _BOWING,
    platforms: bool = False,
    drives: bool = False,
    sites: Sequence[Site] = (),
    backend: Backend = Backend.BEST,
) -> CompiledLoading:
    """Record the equilibrium of a robot under a wrench once, for many poses and wrenches.

    The unloaded posture, the Newton steps from it to equilibrium, and K there become a list of
    operations without branches; legs that carry a force along a line alone, without weight, enter
    as springs between two points. At every pose the record checks that its steps contract and
    arrive, that no leg and no motion of the platform is near a critical load, and that the posture
    is regular; what fails is computed by `equilibrium`.

    Parameters
    ----------
    robot : Robot
        Symbols that are no parameters take their nominal values.
    parameters : sequence of str
        Names of symbols that remain inputs, to be given with the poses; masses may be symbols.
    loads, gravity, preload
        As for `equilibrium`; they act at every pose, beside the wrench.
    beams : Bowing or Linear
        As for `equilibrium`.
    platforms : bool
        Whether answers have the place of the platform and its rates with the parameters, and
        `evaluate` takes forces at hooks.
    drives : bool
        Whether answers have deflections and loads of elastic joints, too, and their rates.
    sites : sequence of (str, (float, float, float))
        Bodies, and points in their frames [m], at which `evaluate` takes forces.
    backend : Backend
        As for `compile`. NumPy runs steps of more than 30,000 operations.

    Returns
    -------
    CompiledLoading

    Raises
    ------
    InputError
        When the robot has laws of force, or when a parameter is no symbol of it or a load does not
        fit.
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

    Weights of the robot, and loads beside the wrench, act at all poses:

    >>> tool = rs.compile_loaded(
    ...     robot, loads={"platform": rs.Mass(2e4)}, backend=rs.Backend.ARRAYS
    ... )
    >>> bool(np.all(tool.evaluate(poses, np.zeros(6)).displacement[:, 2] < 0))
    True
    """
    if not isinstance(robot, Robot):
        subject, hint = "robot to compile under load", 'write compile_loaded(load("hexapod"))'
        raise InputError(subject, got=type(robot).__name__, expected="a Robot", hint=hint)
    with_laws = robot.drives_with_laws
    with_symbols = parameters and any(True for _ in formulas(robot.springs))
    laws = f"laws of force or stiffness: {', '.join(with_laws)}"
    for refused, got, expected in (
        (with_symbols, "springs between bodies with symbols, beside parameters", "numbers"),
        (with_laws, laws, "constant stiffnesses"),
    ):
        if refused:
            subject = f"kernel under load of {robot.name!r}"
            hint = "equilibrium takes them, pose by pose"
            raise InputError(subject, got=got, expected=expected, hint=hint)
    code = code_of(backend)

    taken = [*(c.value for c in ALL_COORDINATES), *robot.space.wrench_order]
    robot = with_parameters(robot, parameters, taken)
    points = ((b, as_floats(f"site on {b!r}", at, "three numbers", None, (3,))) for b, at in sites)
    at_sites = tuple((body, tuple(at.tolist())) for body, at in points)
    given = StandingLoads(loads, gravity, preload, beams), platforms or drives, at_sites
    file = RecordFile.of(robot, [*given, drives])
    read = () if file is None else file.read() or ()
    if len(read) == _PARTS:
        found = CompiledLoading(robot, *given, *read)
    else:
        found = _record(robot, *given, drives)
        if file is not None:
            values = [getattr(found, field.name) for field in fields(found)]
            file.write(tuple(values[-_PARTS:]))
    return found.by(code)


def is_on_disk(robot: Robot, standing: StandingLoads) -> bool:
    """Whether `compile_loaded` reads the kernel of a robot from disk, without parameters."""
    file = RecordFile.of(with_parameters(robot, (), ()), [standing, False, (), False])
    return file is not None and file.path.exists()


def _record(
    robot: Robot, standing: StandingLoads, platforms: bool, sites: tuple[Site, ...], drives: bool
) -> CompiledLoading:
    """A record of a robot under load, confirmed and run by NumPy."""
    finder = posture_finder(robot.numeric)
    placed = _loaded_postures(finder, standing)
    # An arm of rigid links may be rigid at home, where it is stretched out, and nowhere else.
    known = (x.problem for x in placed if not x.problem.at_rest.lacks_digits)
    problem = next((problem for problem in known if not problem.at_rest.rigid), None)
    if problem is None:
        raise _rigid(robot)
    values = np.linalg.eigvalsh(problem.at_rest.K / np.outer(problem.scale, problem.scale))
    if not meets_stiffness(problem.at_rest):
        raise NoAnswerError(
            f"no kernel under load of {robot.name!r}: its platform has free motions, in which a "
            "wrench has no equilibrium; ask rs.equilibrium, wrench by wrench"
        )
    force = 1e-3 * problem.length * float(values[0])  # moves it by a thousandth of that length
    try:
        loading = record_loading(
            robot, finder, placed, force, standing, platforms=platforms, drives=drives, sites=sites
        )
    except RigidLegError as error:
        raise _rigid(robot) from error
    kernel = Kernel(
        inputs=loading.inputs,
        outputs=(StiffnessMatrix(),),
        checks=("flags", "open", "mode"),
        space=robot.space,
        code=ClosedCode.of(loading, loading.arrival, ArrayCode),
    )
    closing, names, closure = loading.closure, loading.joints, None
    if closing is not None and not depends_on_posture(names, closing, finder):
        names = (*names, *loading.rates)
        record = Record({name: np.array([1.0]) for name in names})
        joints = Program.of(record, [record.input(name) for name in names])
        code = ClosedCode.of(closing, joints, ArrayCode)
        closure = Kernel(closing.inputs, (), ("open", "mode"), robot.space, code)
    found = CompiledLoading(
        robot,
        standing,
        platforms,
        sites,
        kernel,
        closure,
        AtGeneralPoses(int(loading.rank), loading.status, verified=True),
        Status.OK,
        loading.has_arms,
        loading.drives,
    )
    return _confirm(found, finder, force)


def kept_loading(
    robot: Robot,
    gravity: Gravity = None,
    loads: Loads | None = None,
    preload: Mapping[str, float] | None = None,
    **settings: Any,
) -> CompiledLoading:
    """What `compile_loaded` makes; without loads and preloads it is kept with the robot."""
    if loads or preload:
        return compile_loaded(robot, gravity=gravity, loads=loads, preload=preload, **settings)
    return _kept(robot, gravity=comparable_gravity(robot, gravity), **settings)


_kept = kept(compile_loaded)


def _loaded_postures(finder: PostureFinder, standing: StandingLoads) -> list[LoadedPosture]:
    """The robot in numbers at home, and at postures around it that it reaches.

    Among them are those at which each strut is shortest and longest: what is known of it holds for
    lengths between these.
    """
    robot = finder.robot
    acting = Acting(**standing.given)
    found = [postures_of(robot, None, None).with_loads(0, acting)]
    random = np.random.default_rng(20111)
    struts = struts_among(found[0].problem)
    drawn = _DRAWN_OF_STRUTS if struts else _DRAWN
    if robot.is_posed_by_joints:
        chain = robot.legs[0].chain
        size = chain.sizes(finder.length)
        shifts = _SPREAD * size * random.uniform(-1, 1, (drawn, len(size)))
        pose = JointCoordinates(chain.home + shifts)
    else:
        places = robot.coordinate_places
        size = np.where(np.array(places) < 3, finder.length, 1.5)
        shifts = _SPREAD * size * random.uniform(-1, 1, (drawn, len(places)))
        pose = finder.home_pose[places] + shifts
    around = postures_of(robot, pose, None)
    posture = cast("Posture", around.posture)
    rows = np.flatnonzero(posture.reached & posture.within_limits)
    lengths = [
        posture.coordinates[k][rows, i]
        for k in sorted(struts)
        for i, screw in enumerate(robot.legs[k].chain.freedoms)
        if rows.size and not screw.is_rotation
    ]
    ends = [rows[at] for x in lengths for at in (x.argmin(), x.argmax())]
    chosen = list(dict.fromkeys([*ends, *rows]))[: max(_POSTURES, len(ends))]
    return [*found, *(around.with_loads(int(k), acting) for k in chosen)]


def _rigid(robot: Robot) -> NoAnswerError:
    why = "a leg is rigid in some direction; give its parts a stiffness"
    return NoAnswerError(f"no kernel under load of {robot.name!r}: {why}")


def _confirm(found: CompiledLoading, finder: PostureFinder, force: float) -> CompiledLoading:
    """The same, once it has been found to agree with equilibria at generic poses.

    Raises
    ------
    DisagreementError
        When it gives something else.
    """
    robot, posture, status = found.robot, sample_postures(finder, 1873), None
    values, acting = parameter_samples(robot, 1873), Acting(**found.standing.given)
    poses: list[JointCoordinates | np.ndarray] = []
    if robot.coordinates or not robot.is_posed_by_joints:
        poses.append(posture.pose[:, robot.coordinate_places])
    if robot.is_posed_by_joints:
        poses.append(JointCoordinates(posture.coordinates[0]))
    for pose in poses:
        given, random = np.asarray(getattr(pose, "values", pose)), np.random.default_rng(5)
        scale = force * np.where(np.array(robot.space.rows) < 3, 1.0, finder.length)
        F = scale * random.uniform(-1, 1, (len(given), robot.space.size))
        F[0] = 0.0
        answer = found.evaluate(pose, F, parameters=values)
        rows = np.reshape(list(values.values()), (len(values), len(given)))
        for other, group in ParameterValues(robot, rows).groups(~answer.guarded):
            part = given[group] if pose is given else JointCoordinates(given[group])
            postures = postures_of(other, part, None)
            for i, k in enumerate(group):
                again = partial(postures.loaded_at, i)
                solution = solve(again(acting), again, F[k])
                one = Equilibrium.of(robot.name, robot.space, solution)
                where = f"{robot.name!r} at {given[k].tolist()} under {F[k].tolist()}"
                if not one.has_answer:
                    raise DisagreementError(_SUBJECT, f"({one.status} against an answer)", where)
                size = np.sqrt(np.diag(one.K))
                off = float(np.max(np.abs(answer.K[k] - one.K) / np.outer(size, size)))
                if not off <= _AGREES:
                    raise DisagreementError(_SUBJECT, off, where)
                status = one.status & ~Status.BEYOND_LIMITS | (status or Status.OK)
    # Poses alone may leave all of them open: of an arm with more than six joints.
    if status is None:
        return replace(found, general=replace(found.general, verified=False))
    return replace(found, status=status)
