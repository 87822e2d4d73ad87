"""Values of a map for a block of poses: by a kernel, and by the direct form of a robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np

from robostiff.analysis.cable_stiffness import are_beyond_limits, cable_stiffness
from robostiff.analysis.compiled_stiffness import CompiledStiffness, compile_stiffness
from robostiff.analysis.deflection_under_load import carried_by, leg_loads
from robostiff.analysis.maps.pose_columns import Mapped, PoseColumns
from robostiff.analysis.maps.variables import Quantity, Variable, map_variables
from robostiff.analysis.measures import (
    principal_stiffnesses,
    stiffness_indices,
    stiffness_where_answered,
    twists_under,
    worst_deflection,
)
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import Stiffness
from robostiff.cables import structure_matrix
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
)
from robostiff.compiled.codes import chunks_of
from robostiff.elastostatics import Status
from robostiff.elastostatics.result import scaled_inverse
from robostiff.errors import InputError
from robostiff.kinematics import find_posture, freedom_twist
from robostiff.linkage import Linkage
from robostiff.model import Actuated, PlacedFreedom, Robot
from robostiff.model.cable import CableRobot
from robostiff.spatial import move_wrench
from robostiff.spatial.batch import empty_batch

# Poses at once: few enough for the cache.
_CHUNK = 4096
# Poses at once by a kernel, at most: their rows of inputs and results take some 30 MB.
_MOST = 2**18
_TAUT = 1e-10  # of the largest tension
_STIFFNESS, _PRINCIPAL, _WORST = StiffnessMatrix(), PrincipalStiffness(), WorstDeflection()
_OF_K = {Quantity.STIFFNESS, Quantity.PRINCIPAL_STIFFNESS, Quantity.INDICES}


@dataclass(frozen=True)
class MapEvaluator:
    """Quantities of a robot at poses, by a kernel or a direct form; picklable.

    Attributes
    ----------
    robot : Robot, Linkage or CableRobot
    columns : PoseColumns
        What the numbers of a pose are.
    quantities : tuple of Quantity
    wrench : tuple of float
        Load about the reference point [N, N m]; empty without one.
    length : float
        Characteristic length of the indices [m].
    near : tuple of float
        Joint coordinates of all legs that choose the posture [m, rad]; empty for home's.
    dtype : str
        Of K.
    form : DirectForm or None
        What computes poses that no kernel does; that of the kind of the robot when left out.
    kernel : CompiledStiffness or None
        Its poses are those of which it is sure.
    """

    robot: Mapped
    columns: PoseColumns
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()
    length: float = 1.0
    near: tuple[float, ...] = ()
    dtype: str = "float64"
    form: DirectForm | None = None
    kernel: CompiledStiffness | None = None

    @property
    def direct(self) -> DirectForm:
        """What computes poses that no kernel does."""
        return self.form or _DIRECT.get(type(self.robot), _LEGS)

    @property
    def method(self) -> str:
        """Name of the method, on which the map depends."""
        if self.kernel is None:
            return self.direct.name
        name = self.direct.name.removesuffix(", batched")
        return f"compiled record, {name} where it is unsafe"

    @property
    def most_poses(self) -> int:
        """Largest suitable number of poses in a call: about half a second."""
        return self.direct.at_once if self.kernel is None else _MOST

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What `evaluate` fills, rank and status among them."""
        return map_variables(self.robot, self.quantities, self.dtype, self.columns.loads > 0)

    def with_kernel(self, backend: Backend) -> MapEvaluator:
        """The same quantities by a kernel.

        Raises
        ------
        InputError
            When the robot has none for these quantities and coordinates.
        """
        robot, columns = self.robot, self.columns

        def refused(got: str, expected: str) -> InputError:
            hint = "leave the method out, or write method=Batched()"
            subject = f"map of {robot.name!r} by a kernel"
            return InputError(subject, got=got, expected=expected, hint=hint)

        if isinstance(robot, CableRobot):
            subject = "method of a map of cables"
            raise InputError(subject, got="Compiled()", expected="Batched(), or none")
        if Quantity.ACTUATOR_FORCES in self.quantities:
            raise refused("actuator forces", "other quantities")
        outputs = {
            _STIFFNESS: {Quantity.STIFFNESS, Quantity.INDICES},
            _PRINCIPAL: {Quantity.PRINCIPAL_STIFFNESS},
            _WORST: {Quantity.WORST_DEFLECTION},
            DeflectionUnder(self.wrench): {Quantity.DEFLECTION},
        }
        wanted = [own for own, quantities in outputs.items() if quantities & set(self.quantities)]
        free = tuple(coordinate.value for coordinate in getattr(robot, "coordinates", ()))
        joints = [name for name, _ in columns.drives] or None
        if not columns.of_joints and columns.names != free:
            expected = f"coordinates that are free: {' '.join(free)}"
            raise refused(" ".join(columns.names), expected)
        made = compile_stiffness(robot, wanted, joints=joints, backend=backend)
        if joints is None and columns.of_joints and not made.takes_joints:
            raise refused("joint coordinates", " ".join(free))
        return replace(self, kernel=made)

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray], *, again: bool = True
    ) -> np.ndarray:
        """Fill arrays (N, ...) of the variables, and return where no kernel is trusted (N,).

        Parameters
        ----------
        poses : (N, n_coordinates) array
            [m, rad], equal coordinates side by side in memory.
        out : mapping of str to (N, ...) arrays
            Fastest with equal entries of all poses side by side.
        again : bool
            Whether the direct form computes the poses that the kernel does not.
        """
        guarded = np.zeros(len(poses), dtype=bool)
        if self.kernel is None:
            for part in chunks_of(slice(0, len(poses)), _CHUNK):
                found = self.direct.compute(self, poses[part])
                for variable in self.variables:
                    out[variable.name][part] = found[variable.name]
                guarded[part] = found.get("guarded", False)
            return guarded
        values = {v.name: out[v.name] for v in self.variables if v.dtype == "float64"}
        for where, found in self.kernel.results(self.columns.as_pose(poses), values):
            here = {name: array[where] for name, array in out.items()}
            here["rank"][...], here["status"][...] = found.rank, found.status_codes
            guarded[where] = found.guarded
            self._put(here, found.values, found.rank, found.guarded, "K" in values)
        rows = np.flatnonzero(guarded)
        if rows.size and again:
            some = {name: array[rows] for name, array in out.items()}
            replace(self, kernel=None).evaluate(poses_at(poses, rows), some)
            for name, own in some.items():
                out[name][rows] = own
        return guarded

    def _put(
        self,
        out: Mapping[str, np.ndarray],
        values: Mapping[str, np.ndarray],
        rank: np.ndarray,
        guarded: np.ndarray,
        has_K: bool,
    ) -> None:
        """Put what a kernel found into arrays (N, ...); K is perhaps there."""
        wanted, d = set(self.quantities), self.robot.space.translations
        if Quantity.STIFFNESS in wanted and not has_K:
            out["K"][...] = values[_STIFFNESS.name]
        if Quantity.PRINCIPAL_STIFFNESS in wanted:
            principal = values[_PRINCIPAL.name].T
            for kind, rows in (("translational", principal[:d]), ("rotational", principal[d:])):
                own = out[f"{kind}_stiffness"].T
                own[...] = rows
                # K is positive semidefinite; what is below zero is rounding.
                np.maximum(own, 0.0, out=own)
        if Quantity.WORST_DEFLECTION in wanted:
            out["worst_deflection"][...] = values[_WORST.name]
        if Quantity.INDICES in wanted:
            K = values[_STIFFNESS.name]
            K[guarded] = np.nan
            for name, own in stiffness_indices(K, rank, self.length).items():
                out[name][...] = own
        if Quantity.DEFLECTION in wanted:
            twist = values[DeflectionUnder.name]
            out["displacement"][...], out["rotation"][...] = twist[:, :d], twist[:, d:]

    def of_matrices(
        self, K: np.ndarray, rank: np.ndarray, worst: Callable[[], np.ndarray], *, definite: bool
    ) -> dict[str, np.ndarray]:
        """What matrices K (N, n, n) say, and the worst deflection (N,), as far as it is wanted."""
        found: dict[str, np.ndarray] = {"K": K, "rank": rank}
        if Quantity.PRINCIPAL_STIFFNESS in self.quantities:
            found |= principal_stiffnesses(K, definite=definite)
        if Quantity.INDICES in self.quantities:
            found |= stiffness_indices(K, rank, self.length)
        if Quantity.WORST_DEFLECTION in self.quantities:
            found["worst_deflection"] = worst()
        return found


@dataclass(frozen=True)
class DirectForm:
    """How a robot is computed without a kernel of its own; picklable.

    Attributes
    ----------
    compute : callable
        Takes the evaluator and poses (N, n_coordinates); returns arrays (N, ...) of the variables,
        and perhaps where a kernel inside was not trusted, ``guarded``.
    name : str
        Of the method.
    at_once : int
        Poses that take about half a second.
    about : object
        What else the numbers depend on, such as loads.
    """

    compute: Callable[[MapEvaluator, np.ndarray], Mapping[str, np.ndarray]]
    name: str
    at_once: int
    about: Any = None


def poses_at(poses: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Some of the poses, equal coordinates side by side in memory as before."""
    return np.ascontiguousarray(poses.T[:, rows]).T


def _of_legs(asked: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    pose, d = asked.columns.as_pose(poses), asked.robot.space.translations
    near = np.array(asked.near) if asked.near else None
    result = direct_stiffness(cast(Any, asked.robot), pose, near=near)
    K = stiffness_where_answered(result) if _OF_K & set(asked.quantities) else np.empty(0)

    def worst() -> np.ndarray:
        return worst_deflection(result.compliances)["worst_deflection"]

    found = asked.of_matrices(K, result.rank, worst, definite=True)
    found["status"] = result.status_codes
    if asked.wrench:
        F = np.array(asked.wrench)
        twist, of_load = twists_under(result, F)
        found["status"] = result.status_codes | of_load
        found |= {"displacement": twist[:, :d], "rotation": twist[:, d:]}
        if Quantity.ACTUATOR_FORCES in asked.quantities:
            known = np.isfinite(twist[:, 0])
            snapshot = find_posture(cast("Robot", asked.robot), pose, near=near).snapshot
            found["actuator_force"] = _actuator_forces(snapshot, result, known, F)
    return found


def _actuator_forces(
    snapshot: Any, result: Stiffness, known: np.ndarray, wrench: np.ndarray
) -> np.ndarray:
    """Load on each actuator (N, actuators) [N or N m]: what its chain carries along it."""
    whole = np.broadcast_to(wrench, (len(known), len(wrench)))
    about_origin = move_wrench(whole, -result.offset)
    loads = leg_loads(result[known], about_origin[known])
    rows, forces = list(result.space.rows), []
    for i, leg in enumerate(snapshot.legs):
        F = np.zeros((len(known), 6))
        if loads is not None:
            F[np.ix_(known, np.array(rows))] = loads.wrenches[i]
        forces += [
            np.einsum("...i,...i->...", freedom_twist(element, result.origin), carried)
            for element, carried in carried_by(leg, result.details().leg_blocks[i], F, rows)
            if isinstance(element, PlacedFreedom) and isinstance(element.role, Actuated)
        ]
    out = empty_batch((len(known),), (len(forces),))
    held = known if loads is not None else np.zeros_like(known)
    out[...] = np.where(held[:, None], np.stack(forces, axis=-1), np.nan)
    return out


def _of_cables(asked: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """Tensions balance the weight; winches are locked before the wrench acts.

    A deflection is linear, and known where no cable becomes slack. Loads among the columns are
    balanced by the tensions instead.
    """
    robot, columns = cast("CableRobot", asked.robot), asked.columns
    F = columns.wrenches(poses) if columns.loads else None
    result = cable_stiffness(robot, columns.as_pose(poses), F)
    K, rank, status = stiffness_where_answered(result), result.rank, result.status_codes
    C, of_wrench = np.full_like(K, np.nan), any(own.needs_wrench for own in asked.quantities)
    if of_wrench or Quantity.WORST_DEFLECTION in asked.quantities:
        stable = (rank == robot.space.size) & ((status & int(Status.UNSTABLE)) == 0)
        C[stable] = scaled_inverse(K[stable], result.placed.characteristic_length[stable])

    def worst() -> np.ndarray:
        return worst_deflection(C)["worst_deflection"]

    found = asked.of_matrices(K, rank, worst, definite=False)
    tensions = np.where(result.answered[:, None], result.tensions, np.nan)
    found |= {"status": status, "tension": tensions}
    found |= {"least_tension": tensions.min(axis=-1), "greatest_tension": tensions.max(axis=-1)}
    if of_wrench:
        x = C @ np.array(asked.wrench)  # tensions then are t - k A x
        change = np.einsum("nij,ni->nj", structure_matrix(result.placed), x)
        tensions = result.tensions - result.axial * change
        slack = np.any(tensions < -_TAUT * result.tensions.max(axis=-1, keepdims=True), axis=-1)
        x, tensions = (np.where(slack[:, None], np.nan, values) for values in (x, tensions))
        beyond, d = are_beyond_limits(robot, tensions), robot.space.translations
        status = status | slack * np.uint16(Status.SLACK)
        found["status"] = status | beyond * np.uint16(Status.BEYOND_LIMITS)
        found |= {"displacement": x[:, :d], "rotation": x[:, d:], "actuator_force": tensions}
    return found


_LEGS = DirectForm(_of_legs, "wrench-basis, batched", 2 * _CHUNK)
_DIRECT = {
    Linkage: DirectForm(_of_legs, "networks", 128),
    CableRobot: DirectForm(_of_cables, "cables, batched", 2 * _CHUNK),
}


class MapMethod(ABC):
    """How the poses of a map are computed."""

    has_loads: ClassVar[bool] = False  # whether poses have loads beside coordinates

    @abstractmethod
    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """What computes a map of so many poses; `like` has the direct form.

        Raises InputError when it does not fit the map.
        """


@dataclass(frozen=True)
class Compiled(MapMethod):
    """By the robot's kernel, see `robostiff.compile`; unsafe poses by the batched form.

    Parameters
    ----------
    backend : Backend
    """

    backend: Backend = Backend.BEST

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By a kernel.

        Raises InputError when there is none for the robot, its coordinates or the quantities.
        """
        return like.with_kernel(self.backend)


@dataclass(frozen=True)
class Batched(MapMethod):
    """By the wrench basis form on batches of poses, see `robostiff.stiffness`."""

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By the direct form."""
        return like
