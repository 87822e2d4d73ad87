"""Values of a map for a block of poses: by the batched form, and by kernels that it guards."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.compiled_answer import CheckedResults
from robostiff.analysis.compiled_linkage import CompiledLinkage, compile_linkage
from robostiff.analysis.compiled_robot import CompiledRobot, compile_robot
from robostiff.analysis.deflection_under_load import carried_by
from robostiff.analysis.leg_loads import leg_loads
from robostiff.analysis.maps.pose_columns import Mapped, PoseColumns
from robostiff.analysis.maps.variables import Quantity, Variable, map_variables
from robostiff.analysis.measures import (
    compliance_where_answered,
    principal_stiffnesses,
    stiffness_indices,
    stiffness_where_answered,
    twists_under,
    worst_deflection,
)
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import (
    Backend,
    DeflectionUnder,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
    unpack,
)
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.kinematics import find_posture, freedom_twist
from robostiff.linkage import Linkage
from robostiff.model import Actuated, PlacedFreedom, Robot
from robostiff.spatial import move_wrench
from robostiff.spatial.batch import empty_batch

# Poses at once: few enough for the cache.
_CHUNK = 4096
_NETWORKS = 128
_OF_K = {Quantity.STIFFNESS, Quantity.PRINCIPAL_STIFFNESS, Quantity.INDICES}


class Evaluator(Protocol):
    """Computes the variables of a map at poses; made once, picklable, safe in several threads."""

    @property
    def method(self) -> str:
        """Name of the method; part of the fingerprint of a map."""
        ...

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns, rank and status among them."""
        ...

    @property
    def most_poses(self) -> int:
        """Largest suitable number of poses in a call."""
        ...

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
class BatchedEvaluator:
    """The wrench basis form on batches of poses, or networks, as `stiffness` has them."""

    robot: Mapped
    columns: PoseColumns  # what the numbers of a pose are
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()  # load about the reference point [N, N m]; empty without one
    length: float = 1.0  # characteristic length of the indices [m]
    # joint coordinates of all legs that choose the posture [m, rad]; empty for home's
    near: tuple[float, ...] = ()

    @property
    def method(self) -> str:
        """Name of the method."""
        return "networks" if isinstance(self.robot, Linkage) else "wrench-basis, batched"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns."""
        return map_variables(self.robot, self.quantities)

    @property
    def most_poses(self) -> int:
        """Two of its own chunks, or a few networks: a block takes about half a second."""
        return _NETWORKS if isinstance(self.robot, Linkage) else 2 * _CHUNK

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates)."""
        count = len(poses)
        out = room_for(self.variables, count) if out is None else out
        for start in range(0, count, _CHUNK):
            part = slice(start, start + _CHUNK)
            for name, values in self._chunk(poses[part]).items():
                out[name][part] = values
        return out

    def _chunk(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        pose = self.columns.as_pose(poses)
        result = careful_stiffness(cast(Any, self.robot), pose, near=self._near)
        status, rank = result.status_codes, result.rank
        K = stiffness_where_answered(result) if _OF_K & set(self.quantities) else np.empty(0)
        found: dict[str, np.ndarray] = {"rank": rank}
        if Quantity.STIFFNESS in self.quantities:
            found["K"] = K
        if Quantity.PRINCIPAL_STIFFNESS in self.quantities:
            found |= principal_stiffnesses(K)
        if Quantity.WORST_DEFLECTION in self.quantities:
            found |= worst_deflection(compliance_where_answered(result))
        if Quantity.INDICES in self.quantities:
            found |= stiffness_indices(K, rank, self.length)
        if self.wrench:
            F = np.array(self.wrench)
            twist, unbalanced = twists_under(result, F)
            status = status | unbalanced * np.uint16(Status.UNBALANCED)
            d = self.robot.space.translations
            if Quantity.DEFLECTION in self.quantities:
                found |= {"displacement": twist[:, :d], "rotation": twist[:, d:]}
            if Quantity.ACTUATOR_FORCES in self.quantities:
                known = np.isfinite(twist[:, 0])
                found["actuator_force"] = self._actuator_forces(pose, result, known, F)
        found["status"] = status
        return found

    @property
    def _near(self) -> np.ndarray | None:
        return np.array(self.near) if self.near else None

    def _actuator_forces(
        self, pose: Any, result: RobotStiffness, known: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray:
        """Load on each actuator (N, actuators) [N or N m]: what its chain carries along it."""
        if not isinstance(self.robot, Robot):
            raise TypeError("actuator forces of a linkage are no quantity of maps")
        whole = np.broadcast_to(wrench, (len(known), len(wrench)))
        about_origin = move_wrench(whole, -result.offset)
        loads = leg_loads(result[known], about_origin[known])
        posture = find_posture(self.robot, pose, near=self._near)
        rows = list(self.robot.space.rows)
        forces = []
        for i, leg in enumerate(posture.snapshot.legs):
            F = np.zeros((len(known), 6))
            if loads is not None:
                F[np.ix_(known, np.array(rows))] = loads.wrenches[i]
            forces += [
                np.einsum("...i,...i->...", freedom_twist(element, result.origin), carried)
                for element, carried in carried_by(leg, result.leg_blocks[i], F, rows)
                if isinstance(element, PlacedFreedom) and isinstance(element.role, Actuated)
            ]
        out = empty_batch((len(known),), (len(forces),))
        held = known if loads is not None else np.zeros_like(known)
        out[...] = np.where(held[:, None], np.stack(forces, axis=-1), np.nan)
        return out


# Poses at once, at most: their rows of inputs and results take some 30 MB.
_MOST = 2**18

_STIFFNESS, _PRINCIPAL = StiffnessMatrix(), PrincipalStiffness()
_WORST = WorstDeflection()


@dataclass(frozen=True)
class CompiledEvaluator:
    """The kernel of a robot, guarded by the batched form of the same quantities."""

    compiled: CompiledRobot | CompiledLinkage
    batched: BatchedEvaluator

    @classmethod
    def of(cls, batched: BatchedEvaluator, backend: Backend) -> CompiledEvaluator:
        """The kernel for the quantities of a batched evaluator."""
        robot, columns = cast("Robot | Linkage", batched.robot), batched.columns
        subject = f"map of {robot.name!r} by a kernel"
        if Quantity.ACTUATOR_FORCES in batched.quantities:
            raise InputError(
                subject, got="actuator forces", expected="other quantities", hint=_OTHERWISE
            )
        if isinstance(robot, Linkage):
            joints = [name for name, _ in columns.drives]
            return cls(
                compile_linkage(robot, _outputs(batched), joints=joints, backend=backend), batched
            )
        free = tuple(coordinate.value for coordinate in robot.coordinates)
        if not columns.of_joints and columns.names != free:
            raise InputError(
                subject,
                got=" ".join(columns.names),
                expected=f"coordinates that are free: {' '.join(free)}",
                hint=_OTHERWISE,
            )
        compiled = compile_robot(robot, _outputs(batched), backend=backend)
        if columns.of_joints and not compiled.takes_joints:
            raise InputError(
                subject, got="joint coordinates", expected=" ".join(free), hint=_OTHERWISE
            )
        return cls(compiled, batched)

    @property
    def method(self) -> str:
        """Name of the method."""
        careful = "networks" if self.batched.columns.drives else "wrench-basis"
        return f"compiled record, {careful} where it is unsafe"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables that `evaluate` returns."""
        return self.batched.variables

    @property
    def most_poses(self) -> int:
        """Enough to hide the cost of a block."""
        return _MOST

    def evaluate(
        self, poses: np.ndarray, out: Mapping[str, np.ndarray] | None = None
    ) -> Mapping[str, np.ndarray]:
        """The variables at poses (N, n_coordinates), and which were ``guarded``."""
        out = room_for(self.variables, len(poses)) if out is None else out
        guarded = np.empty(len(poses), dtype=bool)
        for where, found in self.compiled.results(self.batched.columns.as_pose(poses)):
            self._fill({name: array[where] for name, array in out.items()}, found)
            guarded[where] = found.guarded
        rows = np.flatnonzero(guarded)
        if rows.size:
            for name, values in self.batched.evaluate(poses_at(poses, rows)).items():
                out[name][rows] = values
        return {**out, "guarded": guarded}

    def _fill(self, out: Mapping[str, np.ndarray], found: CheckedResults) -> None:
        """Put the results of a chunk into their places."""
        quantities, rows = self.batched.quantities, found.rows
        d = self.batched.robot.space.translations
        out["rank"][...], out["status"][...] = found.rank, found.status_codes
        if Quantity.STIFFNESS in quantities:
            unpack(rows[_STIFFNESS.name], out["K"])
        if Quantity.PRINCIPAL_STIFFNESS in quantities:
            principal = rows[_PRINCIPAL.name]
            # K is positive semidefinite; what is below zero is rounding.
            np.maximum(principal, 0.0, out=principal)
            unpack(principal[:d], out["translational_stiffness"])
            unpack(principal[d:], out["rotational_stiffness"])
        if Quantity.WORST_DEFLECTION in quantities:
            unpack(rows[_WORST.name], out["worst_deflection"])
        if Quantity.INDICES in quantities:
            n = self.batched.robot.space.size
            K = empty_batch(found.rank.shape, (n, n))
            unpack(rows[_STIFFNESS.name], K)
            K[found.guarded] = np.nan
            for name, values in stiffness_indices(K, found.rank, self.batched.length).items():
                out[name][...] = values
        if Quantity.DEFLECTION in quantities:
            twist = rows[DeflectionUnder.name]
            unpack(twist[:d], out["displacement"])
            unpack(twist[d:], out["rotation"])


_OTHERWISE = "leave the method out, or write method=Batched()"


def _outputs(batched: BatchedEvaluator) -> list[Output]:
    quantities = batched.quantities
    found: list[Output] = []
    if {Quantity.STIFFNESS, Quantity.INDICES} & set(quantities):
        found.append(_STIFFNESS)
    if Quantity.PRINCIPAL_STIFFNESS in quantities:
        found.append(_PRINCIPAL)
    if Quantity.WORST_DEFLECTION in quantities:
        found.append(_WORST)
    if Quantity.DEFLECTION in quantities:
        found.append(DeflectionUnder(batched.wrench))
    return found
