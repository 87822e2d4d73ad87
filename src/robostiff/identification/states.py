"""Postures under loads of a campaign, and where platforms are in them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robostiff.compiled import Backend, ComplianceMatrix, Derivative
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.identification.measurement_kinds import MOTIONS, LoadAxes
from robostiff.identification.measurements import Measurements
from robostiff.identification.unknowns import Unknown
from robostiff.kept import kept
from robostiff.kinematics import JointCoordinates, find_posture
from robostiff.kinematics.machine_pose import actuator_places
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Robot

if TYPE_CHECKING:
    from robostiff.analysis.compiled_stiffness import CompiledStiffness
    from robostiff.statics import Equilibrium
    from robostiff.statics.kernels.compiled_loading import Platforms

# [m] and of 1: as near as a kernel has to be to an equilibrium.
_AGREES = 1e-9
# Of the largest load of a drive: below, none says on which side its play is.
_NO_STRAIN = 1e-9
# States from which on machine code is worth its compilation.
_MANY = 5_000


@frozen
class PlacesInStates:
    """Platforms in S states, and their rates with n parameters, in world axes."""

    points: np.ndarray  # (S, 3): reference points
    axes: np.ndarray  # (S, 3, 3): of the platforms
    twists: np.ndarray  # (S, 6): small displacements from there
    rates: np.ndarray  # (S, 6, n): of both together
    status_codes: np.ndarray
    drives: np.ndarray  # (S, 2, d): deflections of drives, and what they carry
    drive_rates: np.ndarray  # (S, 2, d, n)


@frozen
class States:
    """Different postures under different loads of a campaign, and those of its readings."""

    coordinates: np.ndarray  # (S, n)
    by_joints: bool
    wrenches: np.ndarray  # (S, 6) about the reference point
    levers: np.ndarray  # (S, 3, 3): sum of h f^T from the reference point, platform and world axes
    forces: np.ndarray  # (S, B, 3) at sites, world axes
    sites: tuple[tuple[str, tuple[float, float, float]], ...]  # bodies, and points in their frames
    of_readings: np.ndarray  # (N,)
    of_references: np.ndarray  # (N,)

    @property
    def pose(self) -> np.ndarray | JointCoordinates:
        """As kernels take them."""
        return JointCoordinates(self.coordinates) if self.by_joints else self.coordinates

    @property
    def backend(self) -> Backend:
        """What runs kernels at so many."""
        return Backend.BEST if len(self.coordinates) >= _MANY else Backend.ARRAYS

    @classmethod
    def of(cls, robot: Robot, measured: Measurements, to_instrument: np.ndarray) -> States:
        """Those of a campaign, with the rotation (3, 3) from world to instrument axes.

        Poses of an arm become joints, which its drives are commanded to.
        """
        by_joints = isinstance(measured.postures, JointCoordinates)
        q = measured.coordinates
        if not by_joints:
            posture = find_posture(robot.numeric, measured.postures)
            if robot.is_posed_by_joints:
                q, by_joints = posture.coordinates[0], True
            for k in np.flatnonzero(~posture.reached):
                got = Words("a pose out of reach")
                expected = "a pose that the robot reaches"
                raise InputError(f"posture of {measured.place(int(k))}", got=got, expected=expected)
        # axes (N, 3, 3) of the loads in the world, those of platforms as commanded
        turn = np.tile(np.eye(3), (len(measured), 1, 1))
        turn[[axes is LoadAxes.INSTRUMENT for axes in measured.axes]] = to_instrument.T
        on_platform = np.array([axes is LoadAxes.PLATFORM for axes in measured.axes])
        if on_platform.any():
            pose = find_posture(robot.numeric, measured.postures).pose.reshape(-1, 6)
            turn[on_platform] = turn_by_vector(pose[on_platform, 3:])
        forces = np.einsum("nij,nj->ni", turn, measured.forces)
        hooks = np.nan_to_num(measured.hooks)
        rows = [(body, tuple(at)) for body, at in zip(measured.bodies, hooks.tolist(), strict=True)]
        sites = tuple(dict.fromkeys(at for at in rows if at[0]))
        at_sites = np.array([[at == site for site in sites] for at in rows]).reshape(len(q), -1)
        on_bodies = at_sites[:, :, None] * forces[:, None, :]
        forces = forces * ~at_sites.any(axis=1, keepdims=True)
        point = robot.numeric.reference_point
        from_point = np.where(np.isnan(measured.hooks), 0.0, measured.hooks - point)
        levers = from_point[:, :, None] * forces[:, None, :]
        wrenches = np.einsum("nij,nkj->nki", turn, measured.wrenches.reshape(-1, 2, 3))
        wrenches = wrenches.reshape(-1, 6)
        wrenches[:, :3] += forces
        across = [k for k in range(6) if k not in robot.space.rows]
        for k in np.flatnonzero(np.any(wrenches[:, across], axis=1)):
            got = wrenches[k].tolist()
            expected = f"{', '.join(robot.space.wrench_order)} alone, of a planar robot"
            raise InputError(f"load of {measured.place(int(k))}", got=got, expected=expected)
        moved = measured.are(*MOTIONS)
        from_ = np.array(measured.references)[moved]
        known = (from_ >= 0)[:, None]
        loads = np.column_stack([wrenches, levers.reshape(-1, 9), on_bodies.reshape(len(q), -1)])
        before = np.column_stack([q[moved], np.where(known, loads[from_], 0.0)])
        rows = np.vstack([np.column_stack([q, loads]), before])
        unique, place = np.unique(rows, axis=0, return_inverse=True)
        place, n = place.ravel(), q.shape[1]
        references = np.zeros(len(q), dtype=int)
        references[moved] = place[len(q) :]
        q, W, levers, forces = np.split(unique, [n, n + 6, n + 15], axis=1)
        levers, forces = levers.reshape(-1, 3, 3), forces.reshape(len(unique), -1, 3)
        return cls(q, by_joints, W, levers, forces, sites, place[: len(measured)], references)


@frozen(eq=False)
class FiniteLoads:
    """Equilibria with weights, by the kernel of the robot under load.

    `verify` finds states near singular postures, which the kernel does not answer by itself, once.
    Play of a joint turns it by half of it, in the direction in which it is strained without play.
    """

    states: States
    robot: Robot  # with symbols
    parameters: tuple[Unknown, ...]
    gravity: ArrayLike | str | None = None
    drives: bool = False  # whether what drives carry is asked for
    lost: np.ndarray | None = None  # (S,) of bool: states without rates

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(unknown.name for unknown in self.parameters)

    @property
    def plays(self) -> dict[str, str]:
        """Joints of parameters that are play."""
        return {unknown.name: unknown.plays for unknown in self.parameters if unknown.plays}

    @cached_property
    def compiled(self):
        """The kernel."""
        from robostiff.statics.kernels.compile import kept_loading

        return kept_loading(
            self.robot,
            self.gravity,
            parameters=self.names,
            platforms=True,
            drives=self.drives or bool(self.plays),
            sites=self.states.sites,
            backend=self.states.backend,
        )

    def with_states(self, states: States) -> FiniteLoads:
        """The same for other states."""
        return replace(self, states=states, lost=None)

    def of_readings(self, measured: Measurements, states: States) -> FiniteLoads:
        """The same for other readings, and their states."""
        return replace(self.with_states(states), drives=bool(measured.of_drives.any()))

    @cached_property
    def factors(self) -> np.ndarray:
        """By which parameters are multiplied in states (S, n): half a sign where they are play."""
        factors = np.ones((len(self.states.coordinates), len(self.names)))
        if self.plays:
            factors[:, [name in self.plays for name in self.names]] = 0.0
            vars(self)["factors"] = factors  # without play
            nominal = np.array([unknown.nominal for unknown in self.parameters])
            strains = self._answer(nominal, slice(None), again=False)[1].drives[:, 1]
            sizes = np.nanmax(np.abs(strains), axis=0, initial=0.0)
            for name, joint in self.plays.items():
                strain = strains[:, self.compiled.drives.index(joint)]
                size = sizes[self.compiled.drives.index(joint)]
                strain = np.where(np.abs(np.nan_to_num(strain)) > _NO_STRAIN * size, strain, 0.0)
                factors[:, self.names.index(name)] = 0.5 * np.sign(strain)
        return factors

    @cached_property
    def commanded(self) -> np.ndarray:
        """Coordinates of all drives without load (S, drives), by their names `compiled.drives`."""
        robot = self.robot.numeric
        posture = find_posture(robot, self.states.pose)
        legs = zip(robot.legs, posture.coordinates, actuator_places(robot), strict=True)
        coordinates = {
            f"{leg.name}/{leg.chain.coordinate_names[place]}": q[:, place]
            for leg, q, places in legs
            for place in places
        }
        none = np.full(len(self.states.coordinates), np.nan)
        return np.array([coordinates.get(name, none) for name in self.compiled.drives]).T

    def _answer(
        self, values: np.ndarray, rows: np.ndarray | slice, *, again: bool
    ) -> tuple[Equilibrium, Platforms]:
        """Equilibria and platforms in some states, at values (n,) of the parameters."""
        states, q = self.states, self.states.coordinates[rows]
        result = self.compiled.evaluate(
            JointCoordinates(q) if states.by_joints else q,
            states.wrenches[rows][:, list(self.robot.space.rows)],
            hooks=states.levers[rows],
            forces=states.forces[rows],
            parameters=dict(zip(self.names, (values * self.factors[rows]).T, strict=True)),
            again=again,
        )
        assert result.platforms is not None  # noqa: S101 - it was compiled with them
        return result, result.platforms

    def at(self, values: np.ndarray) -> PlacesInStates:
        """Places at values (n,) of the parameters; no rates in lost states."""
        answer, platforms = self._answer(values, slice(None), again=False)
        order = [self.compiled.parameters.index(name) for name in self.names]
        rates = platforms.rates[:, :, order] * self.factors[:, None]
        of_drives = platforms.drive_rates[..., order] * self.factors[:, None, None]
        rates[answer.guarded if self.lost is None else self.lost] = np.nan
        none = np.zeros((len(rates), 6))
        codes = answer.status_codes
        return PlacesInStates(
            platforms.points, platforms.axes, none, rates, codes, platforms.drives, of_drives
        )

    def verify(self, values: np.ndarray) -> tuple[FiniteLoads, np.ndarray]:
        """The same with those states lost in which kernel and `equilibrium` do not agree.

        And status codes (S,). Without it all states that the kernel guards are lost.
        """
        answer, places = self._answer(values, slice(None), again=False)
        lost, codes = answer.guarded.copy(), answer.status_codes
        rows = np.flatnonzero(lost)
        if rows.size:
            sure, direct = self._answer(values, rows, again=True)
            shift = np.abs(direct.points - places.points[rows]).max(axis=1)
            turn = np.abs(direct.axes - places.axes[rows]).max(axis=(1, 2))
            lost[rows] = ~((shift <= _AGREES) & (turn <= _AGREES))
            codes[rows] = sure.status_codes
        result = replace(self, lost=lost)
        vars(result)["factors"] = self.factors
        return result, codes


@kept
def _compliances(robot: Robot, names: tuple[str, ...], backend: Backend) -> CompiledStiffness:
    """The kernel of the compliance matrix and its rates with parameters."""
    from robostiff.analysis.compiled_stiffness import compile_stiffness

    outputs = [C := ComplianceMatrix(), *(Derivative(C, name) for name in names)]
    return compile_stiffness(robot, outputs, parameters=names, backend=backend)


@frozen(eq=False)
class SmallLoads:
    """Displacements in proportion to loads, by the compliance matrix: ``t = C W``."""

    states: States
    finite: FiniteLoads  # the same by equilibria, for all other readings

    @property
    def robot(self) -> Robot:
        """With symbols."""
        return self.finite.robot

    @cached_property
    def _unloaded(self) -> tuple[np.ndarray, np.ndarray]:
        """Reference points and axes of the platform in the states."""
        robot = self.robot.numeric
        poses = find_posture(robot, self.states.pose).pose.reshape(-1, 6)
        R = turn_by_vector(poses[:, 3:])
        return poses[:, :3] + R @ robot.reference_point, R

    def with_states(self, states: States) -> SmallLoads:
        """The same for other states."""
        return replace(self, states=states)

    def of_readings(self, measured: Measurements, states: States) -> FiniteLoads | SmallLoads:
        """The same for other readings; by equilibria if not all are motions by the platform."""
        if measured.are(*MOTIONS).all() and not states.sites:
            return self.with_states(states)
        return self.finite.of_readings(measured, states)

    def verify(self, values: np.ndarray) -> tuple[SmallLoads, np.ndarray]:
        """Itself, and status codes (S,): what its kernel does not answer is computed again."""
        return self, self.at(values).status_codes

    def at(self, values: np.ndarray) -> PlacesInStates:
        """Places at values (n,) of the parameters."""
        (points, R), rows = self._unloaded, list(self.robot.space.rows)
        names = self.finite.names
        by_name = dict(zip(names, values.tolist(), strict=True))
        compiled = _compliances(self.robot, names, self.states.backend)
        answer = compiled.evaluate(self.states.pose, parameters=by_name)
        B = R @ self.states.levers
        W = self.states.wrenches.copy()
        W[:, 3:] += B[:, [1, 2, 0], [2, 0, 1]] - B[:, [2, 0, 1], [1, 2, 0]]
        C = np.array([answer.values[output.name] for output in compiled.kernel.outputs])
        moved = self.robot.space.spatial(np.einsum("ksij,sj->ski", C, W[:, rows]))
        none, moves = np.zeros((len(W), 2, 0)), (moved[:, 0], np.moveaxis(moved[:, 1:], 1, 2))
        return PlacesInStates(points, R, *moves, answer.status_codes, none, none[..., None])
