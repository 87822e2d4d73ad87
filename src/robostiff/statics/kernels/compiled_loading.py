"""A robot under load, recorded once and evaluated at many poses and wrenches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import AtGeneralPoses, InputRows, answer_of_results
from robostiff.analysis.kernel_inputs import KernelInputs, ParameterValues
from robostiff.compiled import ArrayCode, Kernel, MachineCode
from robostiff.compiled.codes import chunks_of, in_shares
from robostiff.compiled.kernel import whole_threads
from robostiff.elastostatics.status import PoseBatch, Status
from robostiff.errors import InputError, OpenAtHomeError, Words
from robostiff.frozen import frozen
from robostiff.kinematics import JointCoordinates, Pose, Posture, posture_finder
from robostiff.kinematics.turn import pose_after, turn_by_vector
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.model.cable import Weight
from robostiff.record import CLOSED, Program
from robostiff.spatial import as_floats, skew
from robostiff.spatial.rotation import vector_of_quaternion
from robostiff.statics.chains.moving_chain import sum_of_crosses
from robostiff.statics.kernels.leg import Site
from robostiff.statics.loading.given_loads import Acting, StandingLoads, each_load
from robostiff.statics.loading.loaded_posture import (
    LoadedPosture,
    Postures,
    beside,
    postures_of,
    wrenches_of,
)
from robostiff.statics.result import Equilibrium, OnDemand
from robostiff.statics.solution import Solution, solve

# Operations of a step beyond which compiling takes longer than NumPy needs for many poses.
_LONGEST = 30_000
# Of a displacement: by how much a kernel may be off whose rates are used; and of the length.
_SAME, _ROUNDING = 1e-5, 1e-12


@frozen
class Platforms(PoseBatch):
    """Loaded platforms at N poses, and how they move with the n parameters of their robot."""

    points: np.ndarray  #: (N, 3): reference points in the world [m]
    axes: np.ndarray  #: (N, 3, 3): columns: the axes of the platform in the world
    #: (N, 6, n): of the point and of the turn, world axes; not a number where they are not to be
    #: trusted
    rates: np.ndarray
    #: (N, 2, d): deflections of elastic joints and what they carry [rad, m; N m, N]
    drives: np.ndarray
    drive_rates: np.ndarray  #: (N, 2, d, n): of both


def _matrices(K: np.ndarray, wrench: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """`Equilibrium.K_total` from the symmetric part of K (N, r, r), which becomes K.

    Under wrenches (N, r); `arms` (N, 3, 3) are sums of ``b f^T`` over the dead forces f on the
    platform, b from the reference point [N m].
    """
    if K.shape[-1] == 6:  # the antisymmetric part of moments
        K[..., 3:, 3:] -= skew(0.5 * (wrench[..., 3:] + sum_of_crosses(arms)))
    if not np.any(arms):
        return K
    total, turned = K.copy(), [2] if K.shape[-1] == 3 else [0, 1, 2]
    turning = arms - np.trace(arms, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    total[..., -len(turned) :, -len(turned) :] -= turning[..., turned, :][..., turned]
    return total


@dataclass(eq=False)
class SolvedOnDemand(OnDemand):
    """What `equilibrium` finds at poses and wrenches of a kernel, as it is asked for."""

    loading: CompiledLoading
    given: np.ndarray  #: (N, n): poses, or joint coordinates
    by_joints: bool
    F: np.ndarray  #: (N, r): wrenches [N, N m]
    levers: np.ndarray  #: (N, ...): behind those of hooks, forces at sites
    parameters: ParameterValues[Robot]

    def __missing__(self, k: int) -> Solution:
        for _ in self.groups(np.arange(len(self.given)) == k):
            pass
        return self[k]

    def poses(self, rows: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Frames of the platform (..., 6) of some rows (...), after displacements (..., r)."""
        unloaded, points = np.full((len(self.given), 6), np.nan), np.zeros((len(self.given), 3))
        for robot, part in self.parameters.groups(np.isin(np.arange(len(self.given)), rows)):
            with suppress(OpenAtHomeError):
                unloaded[part] = posture_finder(robot).find(self._postures(part)).pose
                points[part] = robot.in_floats.reference_point
        pose, moves = np.nan_to_num(unloaded[rows]), np.zeros((*rows.shape, 6))
        moves[..., list(self.loading.robot.space.rows)] = np.nan_to_num(moved)
        found = pose_after(pose, moves, points[rows])
        found[np.isnan(moved).any(axis=-1)] = np.nan
        return found

    def _postures(self, rows: np.ndarray) -> Pose:
        return JointCoordinates(self.given[rows]) if self.by_joints else self.given[rows]

    def groups(self, wanted: np.ndarray) -> Iterator[tuple[np.ndarray, Posture | None]]:
        """Find some of them (N,), alike parameters together: their numbers, and postures."""
        loading, split = self.loading, 9 * self.loading.has_platforms
        for robot, part in self.parameters.groups(wanted):
            try:
                postures = postures_of(robot, self._postures(part), None)
                posture = postures.posture
            except OpenAtHomeError:  # parameters of no robot: its legs reach no pose from home
                self.update((k, Solution(Status.UNREACHABLE)) for k in part.tolist())
                yield part, None
                continue
            for i, k in enumerate(part.tolist()):
                levers, forces = self.levers[k, :split], self.levers[k, split:].reshape(-1, 3)
                loads: dict[str, Any] = dict(loading.standing.loads or {})
                for (body, point), force in zip(loading.sites, forces, strict=True):
                    before = each_load(body, loads[body]) if body in loads else ()
                    loads[body] = (*before, Weight(force, point))
                acting = Acting(**{**loading.standing.given, "loads": loads or None}, laws={})
                again = partial(_with_levers, postures, i, levers)
                self[k] = solve(again(acting), again, self.F[k])
            yield part, posture


def _with_levers(postures: Postures, i: int, levers: np.ndarray, acting: Acting) -> LoadedPosture:
    """A robot at posture i under loads, and levers of forces that the wrench has."""
    loaded = postures.with_loads(i, acting)
    if not levers.any():
        return loaded
    dead = loaded.problem.dead
    total = dead.levers + loaded.frame[0] @ levers.reshape(3, 3)
    problem = replace(loaded.problem, dead=replace(dead, levers=total))
    return replace(loaded, problem=problem)


@frozen(repr=False)
class CompiledLoading:
    """A robot under load whose equilibria are recorded once, for millions of poses; picklable.

    Attributes
    ----------
    robot : Robot
        Its symbols are the parameters of the kernel.
    standing : StandingLoads
        What acts beside the wrench.
    has_platforms : bool
        Whether answers have places and rates of the platform.
    sites : tuple of (str, (float, float, float))
        Bodies and points of them at which `evaluate` takes forces.
    kernel : Kernel
        Takes the coordinates of the posture, the wrench, then the parameters.
    closure : Kernel or None
        From pose coordinates to those of the legs, where the kernel takes these.
    general : AtGeneralPoses
        Without load.
    status : Status
        At a general pose.
    has_arms : bool
        Whether dead forces act on the platform.
    drives : tuple of str
        Elastic joints whose deflections answers have.
    """

    robot: Robot
    standing: StandingLoads
    has_platforms: bool
    sites: tuple[Site, ...]
    kernel: Kernel
    closure: Kernel | None
    general: AtGeneralPoses
    status: Status
    has_arms: bool
    drives: tuple[str, ...]

    @property
    def verified(self) -> bool:
        """Whether the record was confirmed at generic poses; otherwise none is left to it."""
        return self.general.verified

    def by(self, code: type[MachineCode] | type[ArrayCode]) -> CompiledLoading:
        """The same, run by another code; long steps by NumPy."""

        def chosen(program: Program) -> MachineCode | ArrayCode:
            return code(program) if program.operations <= _LONGEST else ArrayCode(program)

        closure = self.closure and self.closure.by(code)
        return replace(self, kernel=self.kernel.by(chosen), closure=closure)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which may differ from pose to pose."""
        return tuple(str(symbol) for symbol in self.robot.symbols)

    @property
    def _coordinates(self) -> int:
        """Number of inputs of the kernel that are coordinates, of the pose or of all legs."""
        return self.kernel.inputs.index(self.robot.space.wrench_order[0]) - len(self.robot.symbols)

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
        hooks: ArrayLike | None = None,
        forces: ArrayLike | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        again: bool = True,
        threads: int = 1,
    ) -> Equilibrium:
        """Equilibria at many poses, or at one; where a check fails, `equilibrium` computes them.

        Parameters
        ----------
        pose : (N, n) or (n,) array, JointCoordinates, or ActuatorCoordinates of an arm
            Unloaded postures, as `rs.compile` takes them. Of one pose alone, answers are without
            the axis of N.
        wrench : (r,) or (N, r) array
            On the platform about its reference point, world axes [N, N m]; many may act at one
            pose.
        hooks : (3, 3) or (N, 3, 3) array, optional
            Sum of ``h f^T`` over forces f of the wrench at points h from the reference point, in
            platform axes and world axes [N m]: their levers turn with the platform.
        forces : (sites, 3) or (N, sites, 3) array, optional
            At the points `sites` of bodies, world axes [N].
        parameters : mapping of str to a number or (N,) array, optional
            Values of parameters, in SI units; nominal where left out.
        again : bool
            Whether what is guarded is computed again; otherwise `guarded` says what not to trust.
        threads : int

        Raises
        ------
        InputError
            When poses, wrenches or parameters do not fit the robot.
        """
        threads = whole_threads(threads)
        robot, space = self.robot, self.robot.space
        # poses are closed before the record, or by it; or they are coordinates of legs
        joints = 0
        if self.closure is None and self.kernel.inputs[0] not in {c.value for c in ALL_COORDINATES}:
            joints = self._coordinates
        inputs = KernelInputs(robot, joints)
        pose = inputs.read(pose)
        by_joints = isinstance(pose, JointCoordinates)
        numbers = inputs.numbers_of(pose)
        F = beside(numbers.shape[:-1], wrenches_of("wrench", wrench, space))
        given = np.array(np.broadcast_to(numbers, (*F.shape[:-1], numbers.shape[-1])), ndmin=2)
        batch, F, count = F.shape[:-1], np.atleast_2d(F), len(given)
        if hooks is not None and not self.has_platforms:
            hint = "write compile_loaded(..., platforms=True)"
            raise InputError(
                "hooks", got=Words("a kernel without"), expected="one with them", hint=hint
            )
        levers = np.zeros((count, 0))
        shapes = {"hooks": (hooks, (3, 3), "N m")} if self.has_platforms else {}
        shapes["forces at sites"] = forces, (len(self.sites), 3), "N"
        for what, (value, shape, unit) in shapes.items():
            expected = f"{shape}, or one for each of {count} poses [{unit}]"
            array = as_floats(what, np.zeros(shape) if value is None else value, expected)
            if array.shape not in {shape, (count, *shape)}:
                raise InputError(what, got=Words(f"shape {array.shape}"), expected=expected)
            array = np.broadcast_to(array, (count, *shape)).reshape(count, np.prod(shape))
            levers = np.hstack([levers, array])
        values = ParameterValues.of(robot, parameters, count)
        rows = inputs.rows(pose, given, values)
        n, d, r = len(values.rows), len(self.drives), space.size
        arms = np.zeros((count, 3, 3))
        known: dict[str, Any] = {
            "K": np.moveaxis(np.empty((r, r, count)), -1, 0),
            "displacement": np.empty((count, r)),
            "stable": np.ones(count, dtype=bool),
            "guarded": np.empty(count, dtype=bool),
            "wrench": F,
        }
        if self.has_platforms:
            sizes = (3,), (3, 3), (6, n), (2, d), (2, d, n)
            known["platforms"] = Platforms(*(np.full((count, *size), np.nan) for size in sizes))
        solutions = SolvedOnDemand(self, given, by_joints, F, levers, values)
        codes = np.empty(count, dtype=np.uint16)
        answer = Equilibrium(robot.name, space, codes, solutions, np.arange(count), known)

        def fill(part: slice) -> None:
            for chunk in chunks_of(part):
                self._fill(rows, np.hstack([F[chunk], levers[chunk]]), chunk, answer, arms)

        in_shares(fill, count, threads)
        known["K_total"] = _matrices(known["K"], F, arms)
        for part, posture in solutions.groups(known["guarded"] & again):
            self._compute_again(answer, part, posture)
        return answer if batch else answer[0]

    def _fill(
        self, given: InputRows, F: np.ndarray, where: slice, answer: Equilibrium, arms: np.ndarray
    ) -> None:
        """Results of the kernel at a chunk of poses."""
        posture, loose, known = given.rows[:, where], given.loose[where], answer.known
        if self.closure is None:
            rates = np.full((len(self.kernel.inputs) - len(posture) - F.shape[1], len(F)), np.nan)
        else:
            found, joints = self.closure.evaluate(posture), self._coordinates
            posture = np.concatenate([found[:joints], posture[len(self.robot.coordinates) :]])
            rates, loose = found[joints:-2], loose | ~((found[-2] < CLOSED) & (found[-1] > 0))
        inputs, r = np.concatenate([posture, F.T, rates]), self.robot.space.size
        results = self.kernel.evaluate(inputs)
        K = np.moveaxis(results[: r * r].reshape(r, r, -1), -1, 0)
        given = InputRows(inputs, given.missed[where], loose)
        checked = answer_of_results(self.kernel, results, {"K": K}, given, self.general)
        known["K"][where] = K
        rows = r * r
        # Equilibrium is only as good as all that it was computed from.
        last = rows + 7 + 9 * self.has_arms
        unsure = ~np.isfinite(results[:last]).all(axis=0)
        place = np.where(
            unsure, np.array([0.0, 0, 0, 1, 0, 0, 0])[:, None], results[rows : rows + 7]
        )
        if self.has_arms:
            arms[where] = results[rows + 7 : last].T.reshape(-1, 3, 3)
        turn = vector_of_quaternion(place[[4, 5, 6, 3]].T)
        platforms = answer.platforms
        if platforms is not None:
            n, d = platforms.rates.shape[2], 6 + r
            of_drives = 2 * len(self.drives)
            more = results[last : last + 12 + n * d + of_drives * (1 + n)].T
            R = turn_by_vector(turn)
            platforms.points[where] = more[:, :3] + place[:3].T
            platforms.axes[where] = R @ more[:, 3:12].reshape(-1, 3, 3)
            each = more[:, 12 : 12 + n * d].reshape(len(more), n, d)
            rest = more[:, 12 + n * d :].reshape(len(more), 1 + n, 2, len(self.drives))
            platforms.drives[where] = rest[:, 0]
            platforms.drive_rates[where] = np.moveaxis(rest[:, 1:], 1, 3)
            rates = platforms.rates[where]
            rates[:, :3] = np.swapaxes(each[:, :, :3], 1, 2)
            rates[:, 3:] = R @ np.swapaxes(each[:, :, 3:6], 1, 2)
            rates[:, list(self.robot.space.rows)] += np.swapaxes(each[:, :, 6:], 1, 2)
        moved = np.concatenate([place[:3].T, turn], axis=1)
        known["displacement"][where] = moved[:, list(self.robot.space.rows)]
        unreachable = (checked.status_codes & int(Status.UNREACHABLE)) != 0
        known["displacement"][where][unreachable] = np.nan
        known["stable"][where] = ~unreachable
        codes = checked.status_codes.astype(np.uint16)
        kept = np.uint16(int(Status.UNREACHABLE | Status.BEYOND_LIMITS))
        general = np.where(unreachable, 0, int(self.status)).astype(np.uint16)
        answer.status_codes[where] = (codes & kept) | general
        known["guarded"][where] = checked.guarded | (unsure & ~unreachable)

    def _compute_again(
        self, answer: Equilibrium, rows: np.ndarray, posture: Posture | None
    ) -> None:
        """Fill in what `equilibrium` has found in some rows (k,), from their unloaded postures."""
        robot, known, platforms = self.robot, answer.known, answer.platforms
        found = Equilibrium.of(
            robot.name, robot.space, [answer.solutions[k] for k in rows.tolist()]
        )
        displacement = found.displacement.filled(np.nan)
        if platforms is not None and posture is not None:
            # rates where the kernel had the same displacements
            robot, finder = posture.robot, posture_finder(posture.robot)
            unloaded, moved = posture.pose, np.zeros((len(rows), 6))
            moved[:, list(robot.space.rows)] = displacement
            size = np.array([finder.length] * 3 + [1.0] * 3)[list(robot.space.rows)]
            off = np.max(np.abs(known["displacement"][rows] - displacement) / size, axis=1)
            most = np.max(np.abs(displacement) / size, axis=1)
            wrong = rows[~(off <= _SAME * most + _ROUNDING)]
            for rates in (platforms.rates, platforms.drives, platforms.drive_rates):
                rates[wrong] = np.nan
            R = turn_by_vector(unloaded[:, 3:])
            platforms.points[rows] = unloaded[:, :3] + R @ robot.reference_point + moved[:, :3]
            platforms.axes[rows] = turn_by_vector(moved[:, 3:]) @ R
        for name in ("K", "K_total"):
            known[name][rows] = getattr(found, name).filled(np.nan)
        known["displacement"][rows], known["stable"][rows] = displacement, found.stable
        answer.status_codes[rows] = found.status_codes
