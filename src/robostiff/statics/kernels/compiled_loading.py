"""A robot under load, recorded once and evaluated at many poses and wrenches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import AtGeneralPoses, InputRows, decided
from robostiff.analysis.kernel_inputs import KernelInputs, ParameterValues
from robostiff.compiled import Kernel
from robostiff.compiled.closed import ClosedCode
from robostiff.compiled.codes import chunks_of, in_shares
from robostiff.compiled.kernel import whole_threads
from robostiff.elastostatics.status import PoseBatch, Status, StatusOfPoses
from robostiff.errors import InputError, OpenAtHomeError
from robostiff.kinematics import JointCoordinates, Pose, posture_finder
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import ALL_COORDINATES, Robot
from robostiff.model.cable import Weight
from robostiff.record import CLOSED
from robostiff.spatial import as_floats
from robostiff.spatial.rotation import vector_of_quaternion
from robostiff.statics.kernels.leg import Site
from robostiff.statics.loading.given_loads import Acting, StandingLoads, each_load
from robostiff.statics.loading.loaded_posture import postures_of, wrenches_of
from robostiff.statics.result import Equilibria, solved

# Of a displacement: by how much a kernel may be off whose rates are used; and of the length.
_SAME, _ROUNDING = 1e-5, 1e-12


@dataclass(frozen=True)
class Platforms(PoseBatch):
    """Loaded platforms at N poses, and how they move with the n parameters of their robot.

    Attributes
    ----------
    points : (N, 3) array
        Reference points in the world [m].
    axes : (N, 3, 3) array
        Columns: the axes of the platform in the world.
    rates : (N, 6, n) array
        Of the point and of the turn, world axes; not a number where they are not to be trusted.
    drives : (N, 2, d) array
        Deflections of elastic joints and what they carry [rad, m; N m, N].
    drive_rates : (N, 2, d, n) array
        Of both.
    """

    points: np.ndarray
    axes: np.ndarray
    rates: np.ndarray
    drives: np.ndarray
    drive_rates: np.ndarray


@dataclass(frozen=True, repr=False)
class LoadedAnswer(StatusOfPoses, PoseBatch):
    """Equilibria of a robot at N poses under N wrenches, or at one: without the axis of N.

    Attributes
    ----------
    K_sym : (N, r, r) array
        Hessian of the energy about the point that moves along [N/m, N, N m]; not a number where
        there is no answer.
    displacement : (N, r) array
        Of the reference point and rotation vector, from the unloaded posture [m, rad].
    stable : (N,) array of bool
    status_codes : (N,) array of uint16
        See `Status`.
    guarded : (N,) array of bool
        What was computed again by `equilibrium`.
    wrench : (N, r) array
        As given [N, N m].
    arms : (N, 3, 3) array
        Sum of ``b f^T`` over the dead forces f on the platform, b from the reference point [N m].
    platforms : Platforms or None
        Where it was compiled with them.
    """

    K_sym: np.ndarray
    displacement: np.ndarray
    stable: np.ndarray
    status_codes: np.ndarray
    guarded: np.ndarray
    wrench: np.ndarray
    arms: np.ndarray
    platforms: Platforms | None = None

    @property
    def K(self) -> np.ndarray:
        """Rate of the wrench (N, r, r): `K_sym` and the antisymmetric part of moments."""
        K = self.K_sym.copy()
        if K.shape[-1] == 6:
            b_f, f_b = self.arms[..., [1, 2, 0], [2, 0, 1]], self.arms[..., [2, 0, 1], [1, 2, 0]]
            x, y, z = 0.5 * (self.wrench[..., 3:] + b_f - f_b).T
            for (i, j), part in {(3, 4): z, (4, 5): x, (5, 3): y}.items():
                K[..., i, j] += part
                K[..., j, i] -= part
        return K

    @property
    def K_total(self) -> np.ndarray:
        """K less what dead forces on the platform do as it turns (N, r, r)."""
        K = self.K
        turned = [2] if K.shape[-1] == 3 else [0, 1, 2]
        trace = np.trace(self.arms, axis1=-2, axis2=-1)[..., None, None]
        turning = self.arms - trace * np.eye(3)
        K[..., -len(turned) :, -len(turned) :] -= turning[..., turned, :][..., turned]
        return K

    @property
    def guarded_share(self) -> float:
        """Part of the poses that were computed again."""
        return float(np.mean(self.guarded)) if self.guarded.size else 0.0

    def __repr__(self) -> str:
        return (
            f"<LoadedAnswer of {self.stable.size} poses: {self.guarded_share:.2%} recomputed, "
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
    status : Status
        At a general pose.
    standing : StandingLoads
        What acts beside the wrench.
    has_arms : bool
        Whether dead forces act on the platform.
    has_platforms : bool
        Whether answers have places and rates of the platform.
    drives : tuple of str
        Elastic joints whose deflections answers have.
    sites : tuple of (str, (float, float, float))
        Bodies and points of them at which `evaluate` takes forces.
    """

    robot: Robot
    kernel: Kernel
    closure: Kernel | None
    general: AtGeneralPoses
    status: Status
    standing: StandingLoads
    has_arms: bool
    has_platforms: bool = False
    drives: tuple[str, ...] = ()
    sites: tuple[Site, ...] = ()

    @property
    def verified(self) -> bool:
        """Whether the record was confirmed at generic poses; otherwise none is left to it."""
        return self.general.verified

    @property
    def in_arrays(self) -> CompiledLoading:
        """The same without machine code, for few poses."""

        def plain(kernel: Kernel) -> Kernel:
            code = kernel.code
            return replace(kernel, code=code.in_arrays) if isinstance(code, ClosedCode) else kernel

        closure = None if self.closure is None else plain(self.closure)
        return replace(self, kernel=plain(self.kernel), closure=closure)

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
        hooks: ArrayLike | None = None,
        forces: ArrayLike | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        again: bool = True,
        threads: int = 1,
    ) -> LoadedAnswer:
        """Equilibria at many poses, or at one; where a check fails, `equilibrium` computes them.

        Parameters
        ----------
        pose : (N, n) or (n,) array, JointCoordinates, or ActuatorCoordinates of an arm
            Unloaded postures, as `rs.compile` takes them. Of one pose alone, answers are without
            the axis of N.
        wrench : (r,) or (N, r) array
            On the platform about its reference point, world axes [N, N m].
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
        names, joints = self.kernel.inputs, 0
        if self.closure is None and names[0] not in {own.value for own in ALL_COORDINATES}:
            others = len(robot.symbols) + space.size + 9 * self.has_platforms
            joints = len(names) - others - 3 * len(self.sites)
        inputs = KernelInputs(robot, joints)
        pose = inputs.read(pose)
        by_joints = isinstance(pose, JointCoordinates)
        numbers = inputs.checked(pose)
        given = np.atleast_2d(numbers)
        count = len(given)
        F = wrenches_of("wrench", wrench, space)
        if F.ndim == 2 and len(F) not in (1, count):
            raise InputError("wrench", got=f"{len(F)} wrenches", expected=f"one, or {count}")
        F = np.broadcast_to(F, (count, space.size))
        levers = np.zeros((count, 0))
        if self.has_platforms:
            expected = f"(3, 3), or one for each of {count} poses [N m]"
            own = as_floats("hooks", 0.0 if hooks is None else hooks, expected)
            if own.shape not in {(), (3, 3), (count, 3, 3)}:
                raise InputError("hooks", got=f"shape {own.shape}", expected=expected)
            levers = np.broadcast_to(own, (count, 3, 3)).reshape(count, 9)
        elif hooks is not None:
            hint = "write compile_loaded(..., platforms=True)"
            raise InputError("hooks", got="a kernel without", expected="one with them", hint=hint)
        shape = (len(self.sites), 3)
        expected = f"{shape}, or one for each of {count} poses [N]"
        own = as_floats("forces at sites", np.zeros(shape) if forces is None else forces, expected)
        if own.shape not in {shape, (count, *shape)}:
            raise InputError("forces at sites", got=f"shape {own.shape}", expected=expected)
        own = np.broadcast_to(own, (count, *shape)).reshape(count, -1)
        levers = np.hstack([levers, own])
        values = ParameterValues.of(robot, parameters, count)
        rows = inputs.rows(pose, given, values)
        answer = LoadedAnswer(
            K_sym=np.moveaxis(np.empty((space.size, space.size, count)), -1, 0),
            displacement=np.empty((count, space.size)),
            stable=np.ones(count, dtype=bool),
            status_codes=np.empty(count, dtype=np.uint16),
            guarded=np.empty(count, dtype=bool),
            wrench=F,
            arms=np.zeros((count, 3, 3)),
            platforms=Platforms(
                np.full((count, 3), np.nan),
                np.full((count, 3, 3), np.nan),
                np.full((count, 6, len(values.rows)), np.nan),
                np.full((count, 2, len(self.drives)), np.nan),
                np.full((count, 2, len(self.drives), len(values.rows)), np.nan),
            )
            if self.has_platforms
            else None,
        )

        def fill(part: slice) -> None:
            for own in chunks_of(part):
                self._fill(rows, np.hstack([F[own], levers[own]]), own, answer)

        in_shares(fill, count, threads)
        for other, part in values.groups(answer.guarded & again):
            some = JointCoordinates(given[part]) if by_joints else given[part]
            try:
                self._compute_again(other, some, F[part], levers[part], part, answer)
            except OpenAtHomeError:  # parameters of no robot: its legs reach no pose from home
                answer.K_sym[part], answer.displacement[part] = np.nan, np.nan
                answer.stable[part] = False
                answer.status_codes[part] = int(Status.UNREACHABLE)
        return answer[0] if numbers.ndim == 1 else answer

    def _fill(self, given: InputRows, F: np.ndarray, where: slice, answer: LoadedAnswer) -> None:
        """Results of the kernel at a chunk of poses."""
        posture, loose = given.rows[:, where], given.loose[where]
        if self.closure is not None:
            found = self.closure.evaluate(posture)
            posture = np.concatenate([found[:-2], posture[len(self.robot.coordinates) :]])
            loose = loose | ~((found[-2] < CLOSED) & (found[-1] > 0))
        inputs, r = np.concatenate([posture, F.T]), self.robot.space.size
        results = self.kernel.evaluate(inputs)
        K = np.moveaxis(results[: r * r].reshape(r, r, -1), -1, 0)
        given = InputRows(inputs, given.missed[where], loose)
        checked = decided(self.kernel, results, {"K": K}, given, self.general)
        answer.K_sym[where] = K
        rows = r * r
        # Equilibrium is only as good as all that it was computed from.
        last = rows + 7 + 9 * self.has_arms
        unsure = ~np.isfinite(results[:last]).all(axis=0)
        place = np.where(
            unsure, np.array([0.0, 0, 0, 1, 0, 0, 0])[:, None], results[rows : rows + 7]
        )
        if self.has_arms:
            answer.arms[where] = results[rows + 7 : last].T.reshape(-1, 3, 3)
        turn = vector_of_quaternion(place[[4, 5, 6, 3]].T)
        if answer.platforms is not None:
            n, d = answer.platforms.rates.shape[2], 6 + r
            of_drives = 2 * len(self.drives)
            more = results[last : last + 12 + n * d + of_drives * (1 + n)].T
            R = turn_by_vector(turn)
            answer.platforms.points[where] = more[:, :3] + place[:3].T
            answer.platforms.axes[where] = R @ more[:, 3:12].reshape(-1, 3, 3)
            each = more[:, 12 : 12 + n * d].reshape(len(more), n, d)
            rest = more[:, 12 + n * d :].reshape(len(more), 1 + n, 2, len(self.drives))
            answer.platforms.drives[where] = rest[:, 0]
            answer.platforms.drive_rates[where] = np.moveaxis(rest[:, 1:], 1, 3)
            rates = answer.platforms.rates[where]
            rates[:, :3] = np.swapaxes(each[:, :, :3], 1, 2)
            rates[:, 3:] = R @ np.swapaxes(each[:, :, 3:6], 1, 2)
            rates[:, list(self.robot.space.rows)] += np.swapaxes(each[:, :, 6:], 1, 2)
        moved = np.concatenate([place[:3].T, turn], axis=1)
        answer.displacement[where] = moved[:, list(self.robot.space.rows)]
        unreachable = (checked.status_codes & int(Status.UNREACHABLE)) != 0
        answer.displacement[where][unreachable] = np.nan
        answer.stable[where] = ~unreachable
        codes = checked.status_codes.astype(np.uint16)
        kept = np.uint16(int(Status.UNREACHABLE | Status.BEYOND_LIMITS))
        general = np.where(unreachable, 0, int(self.status)).astype(np.uint16)
        answer.status_codes[where] = (codes & kept) | general
        answer.guarded[where] = checked.guarded | (unsure & ~unreachable)

    def _compute_again(
        self,
        robot: Robot,
        pose: Pose,
        F: np.ndarray,
        levers: np.ndarray,
        rows: np.ndarray,
        answer: LoadedAnswer,
    ) -> None:
        postures, each = postures_of(robot, pose, None), []
        split = 9 * self.has_platforms
        for k, (wrench, given) in enumerate(zip(F, levers, strict=True)):
            own, forces = given[:split], given[split:].reshape(-1, 3)
            loads: dict[str, Any] = dict(self.standing.loads or {})
            for (body, point), force in zip(self.sites, forces, strict=True):
                before = each_load(body, loads[body]) if body in loads else ()
                loads[body] = (*before, Weight(force, point))
            acting = Acting(**{**self.standing.given, "loads": loads or None}, laws={})
            loaded = postures.loaded(k, acting)
            if own.any():  # the wrench has their forces
                dead = loaded.problem.dead
                own_levers = dead.levers + loaded.frame[0] @ own.reshape(3, 3)
                problem = replace(loaded.problem, dead=replace(dead, levers=own_levers))
                loaded = replace(loaded, problem=problem)
            each.append(solved(loaded, wrench))
        found = Equilibria(tuple(each))
        K = found.K.filled(np.nan)
        answer.K_sym[rows] = 0.5 * (K + np.swapaxes(K, -1, -2))
        displacement = found.displacement.filled(np.nan)
        if answer.platforms is not None:  # rates where the kernel had the same displacements
            platforms, finder = answer.platforms, posture_finder(robot)
            unloaded, moved = finder.find(pose).pose.reshape(-1, 6), np.zeros((len(rows), 6))
            moved[:, list(robot.space.rows)] = displacement
            size = np.array([finder.length] * 3 + [1.0] * 3)[list(robot.space.rows)]
            off = np.max(np.abs(answer.displacement[rows] - displacement) / size, axis=1)
            most = np.max(np.abs(displacement) / size, axis=1)
            wrong = rows[~(off <= _SAME * most + _ROUNDING)]
            for rates in (platforms.rates, platforms.drives, platforms.drive_rates):
                rates[wrong] = np.nan
            R = turn_by_vector(unloaded[:, 3:])
            platforms.points[rows] = unloaded[:, :3] + R @ robot.reference_point + moved[:, :3]
            platforms.axes[rows] = turn_by_vector(moved[:, 3:]) @ R
        answer.displacement[rows] = displacement
        answer.stable[rows], answer.status_codes[rows] = found.stable, found.status_codes
        for row, one in zip(rows, found, strict=True):
            if one.found is not None:
                answer.arms[row] = one.found.state.R @ one.found.problem.dead.levers
