"""Who computes a block of poses: the interface, and the batched numeric form behind it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robostiff.analysis.maps.actuator_forces import actuator_forces
from robostiff.analysis.maps.pose_batch import PoseBatch
from robostiff.analysis.maps.pose_columns import PoseColumns
from robostiff.analysis.maps.quantities import Quantity
from robostiff.analysis.maps.quantity_variables import map_variables
from robostiff.analysis.maps.variables import Variable
from robostiff.analysis.measures import (
    principal_stiffnesses,
    stiffness_indices,
    worst_deflection,
)
from robostiff.elastostatics import Status
from robostiff.model import Robot
from robostiff.spatial.batch import empty_batch

# Poses at once: few enough for the cache.
_CHUNK = 4096


class Evaluator(Protocol):
    """Computes the variables of a map at poses; made once, picklable, safe in several threads."""

    @property
    def method(self) -> str:
        """How, in words; part of what makes a map that map."""
        ...

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What `evaluate` returns, rank and status among them."""
        ...

    @property
    def most_poses(self) -> int:
        """How many poses it wants at once, at most."""
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
    """The wrench basis form on batches of poses, as `stiffness` has it.

    Parameters
    ----------
    robot : Robot
    columns : PoseColumns
        What the numbers of a pose are.
    quantities : tuple of Quantity
    wrench : tuple of float
        Load about the reference point [N, N m]; empty without one.
    length : float
        Characteristic length of the indices [m].
    """

    robot: Robot
    columns: PoseColumns
    quantities: tuple[Quantity, ...]
    wrench: tuple[float, ...] = ()
    length: float = 1.0

    @property
    def method(self) -> str:
        """How."""
        return "wrench-basis, batched"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What `evaluate` returns."""
        return map_variables(self.robot, self.quantities)

    @property
    def most_poses(self) -> int:
        """Two of its own chunks: a block takes about half a second."""
        return 2 * _CHUNK

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
        batch = PoseBatch(self.robot, self.columns, poses)
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
