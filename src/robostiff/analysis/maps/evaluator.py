"""Values of a map for a block of poses: by a kernel, and by the direct form of a robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np

from robostiff.analysis.cable_stiffness import are_beyond_limits, cable_stiffness
from robostiff.analysis.compiled_stiffness import CompiledStiffness, compile_stiffness
from robostiff.analysis.deflection_under_load import Deflection, carried_by
from robostiff.analysis.maps.pose_columns import Mapped, PoseColumns
from robostiff.analysis.maps.variables import Quantity, Variable, map_variables
from robostiff.analysis.measures import (
    principal_stiffnesses,
    stiffness_indices,
    stiffness_where_answered,
    values_of,
)
from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.result import Stiffness
from robostiff.cables import structure_matrix
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    TensionsOf,
    WorstDeflection,
)
from robostiff.compiled.codes import chunks_of
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.frozen import frozen, replace
from robostiff.kinematics import find_posture
from robostiff.linkage import Linkage
from robostiff.model import Actuated, PlacedFreedom, Robot
from robostiff.model.cable import CableRobot

# Poses at once: few enough for the cache.
_CHUNK = 4096
# Poses at once by a kernel, at most: their rows of inputs and results take some 30 MB.
MOST_BY_KERNEL = 2**18
_TAUT = 1e-10  # of the largest tension
_STIFFNESS, _PRINCIPAL, _WORST = StiffnessMatrix(), PrincipalStiffness(), WorstDeflection()


@frozen
class MapEvaluator:
    """Quantities of a robot at poses, by a kernel or a direct form; picklable."""

    robot: Mapped
    columns: PoseColumns  # what the numbers of a pose are
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()  # load about the reference point [N, N m]; empty without one
    length: float = 1.0  # characteristic length of the indices [m]
    # Joint coordinates of all legs that choose the posture [m, rad]; empty for home's
    near: tuple[float, ...] = ()
    dtype: str = "float64"  # of K
    form: DirectForm | None = None  # that of the kind of the robot when left out
    kernel: CompiledStiffness | None = None  # its poses are those of which it is sure

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

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What `evaluate` fills, rank and status among them."""
        return map_variables(self.robot, self.quantities, self.dtype, self.columns.loads > 0)

    @property
    def outputs(self) -> list[Output]:
        """Outputs of kernels from which the quantities follow."""
        uses: dict[Output, set[Quantity]] = {
            _STIFFNESS: {Quantity.STIFFNESS, Quantity.INDICES},
            _PRINCIPAL: {Quantity.PRINCIPAL_STIFFNESS},
            _WORST: {Quantity.WORST_DEFLECTION},
            DeflectionUnder(self.wrench): {Quantity.DEFLECTION, Quantity.ACTUATOR_FORCES},
            TensionsOf(getattr(self.robot, "cable_names", ())): {Quantity.TENSIONS},
        }
        return [output for output, quantities in uses.items() if quantities & set(self.quantities)]

    def with_kernel(self, backend: Backend) -> MapEvaluator:
        """The same quantities by a kernel.

        Raises InputError when the robot has none for these quantities and coordinates.
        """
        robot, columns = self.robot, self.columns

        def refused(got: str, expected: str) -> InputError:
            hint = "leave the method out, or write method=Batched()"
            subject = f"map of {robot.name!r} by a kernel"
            return InputError(subject, got=got, expected=expected, hint=hint)

        if Quantity.ACTUATOR_FORCES in self.quantities:
            raise refused("actuator forces", "other quantities")
        free = tuple(coordinate.value for coordinate in getattr(robot, "coordinates", ()))
        joints = [name for name, _ in columns.drives] or None
        if not columns.of_joints and columns.names != free:
            expected = f"coordinates that are free: {' '.join(free)}"
            raise refused(" ".join(columns.names), expected)
        made = compile_stiffness(robot, self.outputs, joints=joints, backend=backend)
        if joints is None and columns.of_joints and not made.takes_joints:
            raise refused("joint coordinates", " ".join(free))
        return replace(self, kernel=made)

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray], *, again: bool = True
    ) -> np.ndarray:
        """Fill arrays (N, ...) of the variables, and return where no kernel is trusted (N,).

        At poses (N, n_coordinates) [m, rad]; fastest with equal entries of all poses side by side
        in memory. If `again`, the direct form computes the poses that the kernel does not.
        """
        guarded = np.zeros(len(poses), dtype=bool)
        if self.kernel is None:
            for part in chunks_of(slice(0, len(poses)), _CHUNK):
                result = self.direct.compute(self, poses[part])
                for variable in self.variables:
                    out[variable.name][part] = result[variable.name]
                guarded[part] = result.get("guarded", False)
            return guarded
        values = {v.name: out[v.name] for v in self.variables if v.dtype == "float64"}
        for where, result in self.kernel.results(self.columns.as_pose(poses), values):
            guarded[where] = result.guarded
            if _STIFFNESS.name in result.values:
                result.values[_STIFFNESS.name][result.guarded] = np.nan
            known = self.of_outputs(result.values, result.rank) | {"status": result.status_codes}
            for name in known.keys() - values.keys():
                out[name][where] = known[name]
        rows = np.flatnonzero(guarded)
        if rows.size and again:
            recomputed = {name: array[rows] for name, array in out.items()}
            replace(self, kernel=None).evaluate(poses_at(poses, rows), recomputed)
            for name, array in recomputed.items():
                out[name][rows] = array
        return guarded

    def of_outputs(
        self, values: Mapping[str, np.ndarray], rank: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Rank and variables (N, ...) that follow from values of outputs (N, ...), by name.

        Eigenvalues that are not among them are those of K, and may be below zero.
        """
        wanted, d = set(self.quantities), self.robot.space.translations
        results = {"rank": rank}
        if Quantity.STIFFNESS in wanted:
            results["K"] = values[_STIFFNESS.name]
        if Quantity.PRINCIPAL_STIFFNESS in wanted:
            if _PRINCIPAL.name in values:  # of a semidefinite K: what is below zero is rounding
                k = np.maximum(values[_PRINCIPAL.name], 0.0)
            else:
                k = principal_stiffnesses(values[_STIFFNESS.name], definite=False)
            results |= {"translational_stiffness": k[:, :d], "rotational_stiffness": k[:, d:]}
        if Quantity.INDICES in wanted:
            results |= stiffness_indices(values[_STIFFNESS.name], rank, self.length)
        if Quantity.WORST_DEFLECTION in wanted:
            results["worst_deflection"] = values[_WORST.name]
        if Quantity.DEFLECTION in wanted and DeflectionUnder.name in values:
            twist = values[DeflectionUnder.name]
            results |= {"displacement": twist[:, :d], "rotation": twist[:, d:]}
        if Quantity.TENSIONS in wanted:
            results["tension"] = tensions = values[TensionsOf.name]
            results["least_tension"] = tensions.min(axis=-1)
            results["greatest_tension"] = tensions.max(axis=-1)
        return results


@frozen
class DirectForm:
    """How a robot is computed without a kernel of its own; picklable."""

    # Takes the evaluator and poses (N, n_coordinates); returns arrays (N, ...) of the variables,
    # and perhaps where a kernel inside was not trusted, ``guarded``
    compute: Callable[[MapEvaluator, np.ndarray], Mapping[str, np.ndarray]]
    name: str  # of the method
    at_once: int  # poses that take about half a second
    about: Any = None  # what else the numbers depend on, such as loads


def poses_at(poses: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Some of the poses, equal coordinates side by side in memory as before."""
    return np.ascontiguousarray(poses.T[:, rows]).T


def _of_legs(e: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """Rank, status and variables at poses (N, names), by the batched form."""
    pose, near = e.columns.as_pose(poses), np.array(e.near) if e.near else None
    result = direct_stiffness(cast(Any, e.robot), pose, near=near)
    values: dict[str, np.ndarray] = {}
    codes = result.status_codes
    for output in e.outputs:
        values[output.name], of_load = values_of(output, result)
        codes = codes | of_load
    results = e.of_outputs(values, result.rank) | {"status": codes}
    if Quantity.ACTUATOR_FORCES in e.quantities:
        snapshot = find_posture(cast("Robot", e.robot), pose, near=near).snapshot
        results["actuator_force"] = _actuator_forces(snapshot, result, np.array(e.wrench))
    return results


def _actuator_forces(snapshot: Any, result: Stiffness, wrench: np.ndarray) -> np.ndarray:
    """Load on each actuator (N, actuators) [N or N m]: what its chain carries along it."""
    bent = Deflection(np.broadcast_to(wrench, (*result.batch_shape, len(wrench))), result)
    blocks, forces = result.details().leg_blocks, []
    for leg, wrenches, solved in zip(snapshot.legs, bent.leg_wrenches, blocks, strict=True):
        F = result.space.spatial(np.ma.getdata(wrenches))  # no number where the load has no answer
        forces += [
            np.einsum("...i,...i->...", element.twist(result.origin), carried)
            for element, carried in carried_by(leg, solved, F, result.space)
            if isinstance(element, PlacedFreedom) and isinstance(element.role, Actuated)
        ]
    return np.stack(forces, axis=-1)


def _of_cables(evaluator: MapEvaluator, poses: np.ndarray) -> dict[str, np.ndarray]:
    """Tensions balance the weight; winches are locked before the wrench acts.

    A deflection is linear, and known where no cable becomes slack. Loads among the columns are
    balanced by the tensions instead.
    """
    robot, columns = cast("CableRobot", evaluator.robot), evaluator.columns
    F = columns.wrenches(poses) if columns.loads else None
    result = cable_stiffness(robot, columns.as_pose(poses), F)
    status, values = result.status_codes, {_STIFFNESS.name: stiffness_where_answered(result)}
    for output in {_WORST, TensionsOf(robot.cable_names)} & set(evaluator.outputs):
        values[output.name] = values_of(output, result)[0]
    results = evaluator.of_outputs(values, result.rank) | {"status": status}
    if any(q.needs_wrench for q in evaluator.quantities):
        x = result.compliances @ np.array(evaluator.wrench)  # tensions then are t - k A x
        change = np.einsum("nij,ni->nj", structure_matrix(result.placed), x)
        tensions = result.tensions - result.axial * change
        slack = np.any(tensions < -_TAUT * result.tensions.max(axis=-1, keepdims=True), axis=-1)
        x, tensions = (np.where(slack[:, None], np.nan, values) for values in (x, tensions))
        beyond = np.any(are_beyond_limits(robot, tensions), axis=-1)
        d = robot.space.translations
        status = status | slack * np.uint16(Status.SLACK)
        results["status"] = status | beyond * np.uint16(Status.BEYOND_LIMITS)
        results |= {"displacement": x[:, :d], "rotation": x[:, d:], "actuator_force": tensions}
    return results


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


@frozen
class Compiled(MapMethod):
    """By the robot's kernel, see `robostiff.compile`; unsafe poses by the batched form.

    Parameters
    ----------
    backend : Backend
    """

    backend: Backend = Backend.BEST

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By a kernel; InputError when there is none for robot, coordinates or quantities."""
        return like.with_kernel(self.backend)


@frozen
class Batched(MapMethod):
    """By the wrench basis form on batches of poses, see `robostiff.stiffness`."""

    def evaluator(self, like: MapEvaluator, count: int) -> MapEvaluator:
        """By the direct form."""
        return like
