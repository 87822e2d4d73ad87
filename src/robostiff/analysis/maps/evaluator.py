"""Values of a map for a block of poses: in batches, and by kernels that these guard."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, cast

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness, are_beyond_limits, cable_stiffness
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
_NETWORKS = 128
# Poses at once by a kernel, at most: their rows of inputs and results take some 30 MB.
_MOST = 2**18
_TAUT = 1e-10  # of the largest tension
_STIFFNESS, _PRINCIPAL, _WORST = StiffnessMatrix(), PrincipalStiffness(), WorstDeflection()
_OF_K = {Quantity.STIFFNESS, Quantity.PRINCIPAL_STIFFNESS, Quantity.INDICES}


class Evaluator(Protocol):
    """Computes the variables of a map at poses; made once, picklable, safe in several threads.

    Attributes
    ----------
    method : str
        Name of the method; part of the fingerprint of a map.
    variables : tuple of Variable
        Those that `evaluate` returns, rank and status among them.
    most_poses : int
        Largest suitable number of poses in a call.
    """

    @property
    def method(self) -> str: ...  # noqa: D102
    @property
    def variables(self) -> tuple[Variable, ...]: ...  # noqa: D102
    @property
    def most_poses(self) -> int: ...  # noqa: D102

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """One array a variable, poses along the first axis.

        A fast evaluator adds ``guarded``, an array of bool: poses that it gave to the batched
        numeric form, as its own record does not hold there.
        Poses (N, n_coordinates) [m, rad] have equal coordinates side by side in memory; arrays
        (N, ...) of `room_for` are filled and returned when given.
        """
        ...


def room_for(variables: Iterable[Variable], count: int) -> dict[str, np.ndarray]:
    """Arrays for variables at poses, equal entries of all poses side by side.

    Examples
    --------
    >>> room_for([Variable("K", ("row", "column"), (6, 6), "", "")], 10)["K"].shape
    (10, 6, 6)
    """
    return {v.name: empty_batch((count,), v.shape, v.dtype) for v in variables}


def poses_at(poses: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Some of the poses, equal coordinates side by side in memory as before."""
    return np.ascontiguousarray(poses.T[:, rows]).T


@dataclass(frozen=True)
class MapEvaluator:
    """Quantities at batches of poses; by a kernel where there is one, which these batches guard.

    Robots have the wrench basis form, linkages are networks. The tensions of cables are those of
    `cable_stiffness`: they balance the weight, and winches are locked before the wrench acts.
    """

    robot: Mapped
    columns: PoseColumns  # what the numbers of a pose are
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()  # load about the reference point [N, N m]; empty without one
    length: float = 1.0  # characteristic length of the indices [m]
    # joint coordinates of all legs that choose the posture [m, rad]; empty for home's
    near: tuple[float, ...] = ()
    dtype: str = "float64"  # of K
    kernel: CompiledStiffness | None = None
    recomputes: bool = True  # else poses that the kernel does not answer are left ``guarded``

    @property
    def method(self) -> str:
        """Name of the method."""
        if isinstance(self.robot, CableRobot):
            return "cables, batched"
        is_network = isinstance(self.robot, Linkage)
        if self.kernel is not None:
            direct = "networks" if is_network else "wrench-basis"
            return f"compiled record, {direct} where it is unsafe"
        return "networks" if is_network else "wrench-basis, batched"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns."""
        return self._variables

    @cached_property
    def _variables(self) -> tuple[Variable, ...]:
        return map_variables(self.robot, self.quantities, self.dtype, self.columns.loads > 0)

    @property
    def of_wrench(self) -> tuple[Quantity, ...]:
        """Quantities about the load."""
        return tuple(quantity for quantity in self.quantities if quantity.needs_wrench)

    @property
    def most_poses(self) -> int:
        """So many that the cost of a block is hidden, and that it takes about half a second."""
        if self.kernel is not None:
            return _MOST
        return _NETWORKS if isinstance(self.robot, Linkage) else 2 * _CHUNK

    def with_kernel(self, backend: Backend) -> MapEvaluator:
        """The same quantities by a kernel.

        Raises
        ------
        InputError
            When the robot has none for these quantities and coordinates.
        """
        robot, columns = cast("Robot | Linkage", self.robot), self.columns

        def refused(got: str, expected: str) -> InputError:
            hint = "leave the method out, or write method=Batched()"
            subject = f"map of {robot.name!r} by a kernel"
            return InputError(subject, got=got, expected=expected, hint=hint)

        if Quantity.ACTUATOR_FORCES in self.quantities:
            raise refused("actuator forces", "other quantities")
        outputs = {
            _STIFFNESS: {Quantity.STIFFNESS, Quantity.INDICES},
            _PRINCIPAL: {Quantity.PRINCIPAL_STIFFNESS},
            _WORST: {Quantity.WORST_DEFLECTION},
            DeflectionUnder(self.wrench): {Quantity.DEFLECTION},
        }
        wanted = [own for own, quantities in outputs.items() if quantities & set(self.quantities)]
        if isinstance(robot, Linkage):
            joints = [name for name, _ in columns.drives]
            made = compile_stiffness(robot, wanted, joints=joints, backend=backend)
            return replace(self, kernel=made)
        free = tuple(coordinate.value for coordinate in robot.coordinates)
        if not columns.of_joints and columns.names != free:
            raise refused(" ".join(columns.names), f"coordinates that are free: {' '.join(free)}")
        made = compile_stiffness(robot, wanted, backend=backend)
        if columns.of_joints and not made.takes_joints:
            raise refused("joint coordinates", " ".join(free))
        return replace(self, kernel=made)

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates); of a kernel, which were ``guarded``, too."""
        count = len(poses)
        out = room_for(self.variables, count) if out is None else out
        if self.kernel is not None:
            return self._by_kernel(self.kernel, poses, out)
        of_some = self._of_cables if isinstance(self.robot, CableRobot) else self._of_legs
        for start in range(0, count, _CHUNK):
            part = slice(start, start + _CHUNK)
            found = of_some(poses[part])
            for name, array in out.items():
                array[part] = found[name]
        return out

    def _by_kernel(
        self, kernel: CompiledStiffness, poses: np.ndarray, out: Mapping[str, np.ndarray]
    ) -> Mapping[str, np.ndarray]:
        guarded = np.empty(len(poses), dtype=bool)
        wanted, d = set(self.quantities), self.robot.space.translations
        direct = {v.name: out[v.name] for v in self.variables if v.dtype == "float64"}
        for where, found in kernel.results(self.columns.as_pose(poses), direct):
            values = found.values
            here = {name: array[where] for name, array in out.items()}
            here["rank"][...], here["status"][...] = found.rank, found.status_codes
            guarded[where] = found.guarded
            if Quantity.STIFFNESS in wanted and "K" not in direct:
                here["K"][...] = values[_STIFFNESS.name]
            if Quantity.PRINCIPAL_STIFFNESS in wanted:
                principal = values[_PRINCIPAL.name].T
                for kind, rows in (("translational", principal[:d]), ("rotational", principal[d:])):
                    own = here[f"{kind}_stiffness"].T
                    own[...] = rows
                    # K is positive semidefinite; what is below zero is rounding.
                    np.maximum(own, 0.0, out=own)
            if Quantity.WORST_DEFLECTION in wanted:
                here["worst_deflection"][...] = values[_WORST.name]
            if Quantity.INDICES in wanted:
                K = values[_STIFFNESS.name]
                K[found.guarded] = np.nan
                for name, own in stiffness_indices(K, found.rank, self.length).items():
                    here[name][...] = own
            if Quantity.DEFLECTION in wanted:
                twist = values[DeflectionUnder.name]
                here["displacement"][...] = twist[:, :d]
                here["rotation"][...] = twist[:, d:]
        rows = np.flatnonzero(guarded)
        if rows.size and self.recomputes:
            direct_form = replace(self, kernel=None)
            for name, own in direct_form.evaluate(poses_at(poses, rows)).items():
                out[name][rows] = own
        return {**out, "guarded": guarded}

    def _of_matrices(
        self, K: np.ndarray, rank: np.ndarray, C: Callable[[], np.ndarray], definite: bool
    ) -> dict[str, np.ndarray]:
        """What K (N, n, n) and the compliance say, as far as it is wanted."""
        found: dict[str, np.ndarray] = {"K": K, "rank": rank}
        if Quantity.PRINCIPAL_STIFFNESS in self.quantities:
            found |= principal_stiffnesses(K, definite=definite)
        if Quantity.INDICES in self.quantities:
            found |= stiffness_indices(K, rank, self.length)
        if Quantity.WORST_DEFLECTION in self.quantities:
            found |= worst_deflection(C())
        return found

    def _of_legs(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        pose = self.columns.as_pose(poses)
        near = np.array(self.near) if self.near else None
        result = direct_stiffness(cast(Any, self.robot), pose, near=near)
        status = result.status_codes
        K = stiffness_where_answered(result) if _OF_K & set(self.quantities) else np.empty(0)
        found = self._of_matrices(K, result.rank, lambda: result.compliances, definite=True)
        if self.wrench:
            F = np.array(self.wrench)
            twist, of_load = twists_under(result, F)
            status = status | of_load
            d = self.robot.space.translations
            found |= {"displacement": twist[:, :d], "rotation": twist[:, d:]}
            if Quantity.ACTUATOR_FORCES in self.quantities:
                known = np.isfinite(twist[:, 0])
                snapshot = find_posture(cast("Robot", self.robot), pose, near=near).snapshot
                found["actuator_force"] = _actuator_forces(snapshot, result, known, F)
        found["status"] = status
        return found

    def _of_cables(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """Of cables; a deflection is linear, and known where no cable becomes slack.

        Loads among the columns are balanced by the tensions instead.
        """
        robot = cast("CableRobot", self.robot)
        F = self.columns.wrenches(poses) if self.columns.loads else None
        result = cable_stiffness(robot, self.columns.as_pose(poses), F)
        K, rank, status = stiffness_where_answered(result), result.rank, result.status_codes
        C = np.full_like(K, np.nan)
        if {Quantity.WORST_DEFLECTION, *self.of_wrench} & set(self.quantities):
            stable = (rank == robot.space.size) & ((status & int(Status.UNSTABLE)) == 0)
            C[stable] = scaled_inverse(K[stable], result.placed.characteristic_length[stable])
        found = self._of_matrices(K, rank, lambda: C, definite=False)
        found["status"] = status
        tensions = np.where(result.answered[:, None], result.tensions, np.nan)
        found["tension"] = tensions
        found["least_tension"] = tensions.min(axis=-1)
        found["greatest_tension"] = tensions.max(axis=-1)
        if self.of_wrench:
            found |= cables_under_wrench(robot, result, C, np.array(self.wrench))
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


def cables_under_wrench(
    robot: CableRobot, result: CableStiffness, C: np.ndarray, wrench: np.ndarray
) -> dict[str, np.ndarray]:
    """Twist x = C F and tensions t - k A x under a wrench (n,), with the status."""
    x = C @ wrench
    change = np.einsum("nij,ni->nj", structure_matrix(result.placed), x)
    tensions = result.tensions - result.axial * change
    slack = np.any(tensions < -_TAUT * result.tensions.max(axis=-1, keepdims=True), axis=-1)
    x, tensions = (np.where(slack[:, None], np.nan, values) for values in (x, tensions))
    beyond = are_beyond_limits(robot, tensions)
    status = result.status_codes | slack * np.uint16(Status.SLACK)
    d = robot.space.translations
    return {
        "displacement": x[:, :d],
        "rotation": x[:, d:],
        "actuator_force": tensions,
        "status": status | beyond * np.uint16(Status.BEYOND_LIMITS),
    }
