"""Values of a map for a block of poses: the interface, and the batched form behind it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from robostiff.analysis.careful_form import careful_stiffness
from robostiff.analysis.deflection_under_load import leg_loads
from robostiff.analysis.guarded_values import (
    compliance_where_answered,
    origin_to_reference,
    stiffness_where_answered,
    twists_under,
)
from robostiff.analysis.maps.pose_columns import PoseColumns
from robostiff.analysis.maps.variables import Quantity, Variable, map_variables
from robostiff.analysis.measures import (
    principal_stiffnesses,
    stiffness_indices,
    worst_deflection,
)
from robostiff.analysis.result import RobotStiffness
from robostiff.elastostatics import Status
from robostiff.kinematics import find_posture, freedom_twist
from robostiff.linkage import Linkage
from robostiff.model import Actuated, Robot
from robostiff.spatial import move_wrench
from robostiff.spatial.batch import empty_batch


class PoseBatch:
    """Results from which the quantities of a map are computed, each computed once.

    Parameters
    ----------
    robot : Robot
    columns : PoseColumns
    poses : (N, n_coordinates) array
        [m, rad].
    near : (size,) array, optional
        Joint coordinates of all legs that choose the posture [m, rad].
    """

    def __init__(
        self,
        robot: Robot | Linkage,
        columns: PoseColumns,
        poses: np.ndarray,
        near: np.ndarray | None = None,
    ) -> None:
        self.robot = robot
        self.columns = columns
        self.poses = poses
        self.near = near

    @cached_property
    def result(self) -> RobotStiffness:
        """Stiffness at all poses."""
        return careful_stiffness(self.robot, self.columns.as_pose(self.poses), near=self.near)

    @cached_property
    def rank(self) -> np.ndarray:
        """Rank of K (N,); -1 where out of reach."""
        return self.result.rank

    @cached_property
    def offset(self) -> np.ndarray:
        """From where the answer was computed to the reference point (N, 3) or (N, 2) [m]."""
        return origin_to_reference(self.result)

    @cached_property
    def K(self) -> np.ndarray:
        """Stiffness matrices (N, n, n); NaN where there is none."""
        return stiffness_where_answered(self.result)

    @cached_property
    def compliance(self) -> np.ndarray:
        """Compliance matrices (N, n, n); NaN where there is none."""
        return compliance_where_answered(self.result)

    def moved(self, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Twist of the reference point under a wrench, and where the load drives a free motion.

        The least displacement, where free motions remain that the load does not feel.

        Returns
        -------
        twist : (N, n) array
            [m, rad]; NaN where there is none.
        unbalanced : (N,) array of bool
        """
        return twists_under(self.result, wrench)


def actuator_forces(batch: PoseBatch, twist: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Load on each actuator along its coordinate (N, actuators) [N or N m].

    Of what a leg carries an actuator feels the part along its own motion.

    Parameters
    ----------
    batch : PoseBatch
    twist : (N, n) array
        Of the reference point under the wrench; NaN where there is none.
    wrench : (n,) array
        About the reference point.
    """
    result, robot = batch.result, batch.robot
    if not isinstance(robot, Robot):
        raise TypeError("actuator forces of a linkage are no quantity of maps")
    known = np.isfinite(twist[:, 0])
    whole = np.broadcast_to(wrench, (len(twist), len(wrench)))
    loads = leg_loads(result[known], move_wrench(whole, -batch.offset)[known])
    pose = batch.columns.as_pose(batch.poses)
    posture = find_posture(robot, pose, near=batch.near)
    rows = list(robot.space.rows)
    columns = [
        (i, freedom_twist(freedom, result.origin)[..., rows])
        for i, leg in enumerate(posture.snapshot.legs)
        for freedom in leg.freedoms
        if isinstance(freedom.role, Actuated)
    ]
    out = empty_batch((len(twist),), (len(columns),))
    out[...] = np.nan
    if loads is not None:
        for k, (i, column) in enumerate(columns):
            out[known, k] = np.einsum("...i,...i->...", column[known], loads.wrenches[i])
    return out


# Poses at once: few enough for the cache.
_CHUNK = 4096
_NETWORKS = 128


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

        Parameters
        ----------
        poses : (N, n_coordinates) array
            [m, rad]; equal coordinates of all poses side by side in memory.
        out : mapping of str to (N, ...) arrays, optional
            Filled and returned when given, see `room_for`.
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


@dataclass(frozen=True)
class BatchedEvaluator:
    """The wrench basis form on batches of poses, or networks, as `stiffness` has them.

    Parameters
    ----------
    robot : Robot or Linkage
    columns : PoseColumns
        What the numbers of a pose are.
    quantities : tuple of Quantity
    wrench : tuple of float
        Load about the reference point [N, N m]; empty without one.
    length : float
        Characteristic length of the indices [m].
    near : tuple of float
        Joint coordinates of all legs that choose the posture [m, rad]; empty for home's.
    """

    robot: Robot | Linkage
    columns: PoseColumns
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()
    length: float = 1.0
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
        batch = PoseBatch(
            self.robot, self.columns, poses, np.array(self.near) if self.near else None
        )
        status = batch.result.status_codes
        found: dict[str, np.ndarray] = {"rank": batch.rank}
        if Quantity.STIFFNESS in self.quantities:
            found["K"] = batch.K
        if Quantity.PRINCIPAL_STIFFNESS in self.quantities:
            found |= principal_stiffnesses(batch.K)
        if Quantity.WORST_DEFLECTION in self.quantities:
            found |= worst_deflection(batch.compliance)
        if Quantity.INDICES in self.quantities:
            found |= stiffness_indices(batch.K, batch.rank, self.length)
        if self.wrench:
            F = np.array(self.wrench)
            twist, unbalanced = batch.moved(F)
            status = status | unbalanced * np.uint8(Status.UNBALANCED)
            d = self.robot.space.translations
            if Quantity.DEFLECTION in self.quantities:
                found |= {"displacement": twist[:, :d], "rotation": twist[:, d:]}
            if Quantity.ACTUATOR_FORCES in self.quantities:
                found["actuator_force"] = actuator_forces(batch, twist, F)
        found["status"] = status
        return found
