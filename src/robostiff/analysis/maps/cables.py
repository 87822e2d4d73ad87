"""Maps of cable robots: tensions, stiffness and deflection at batches of poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.analysis.cable_stiffness import CableStiffness, cable_stiffness
from robostiff.analysis.loaded_cables import are_beyond_limits
from robostiff.analysis.maps.evaluator import BatchedEvaluator
from robostiff.analysis.maps.variables import Quantity
from robostiff.analysis.measures import (
    principal_stiffnesses,
    stiffness_indices,
    stiffness_where_answered,
    worst_deflection,
)
from robostiff.cables import structure_matrix
from robostiff.elastostatics import Status
from robostiff.elastostatics.result import scaled_inverse
from robostiff.model.cable import CableRobot

_TAUT = 1e-10


@dataclass(frozen=True)
class CableEvaluator(BatchedEvaluator):
    """Cables at batches of poses, as `cable_stiffness` has them, by the tension rule of the robot.

    The tensions balance the weight, and the winches are locked before the wrench of the map acts.
    Its deflection is linear and known where no cable becomes slack. Loads among the columns are
    balanced by the tensions instead.
    """

    @property
    def method(self) -> str:
        """Name of the method."""
        return "cables, batched"

    def _chunk(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        robot, quantities = self.robot, self.quantities
        if not isinstance(robot, CableRobot):
            raise TypeError("a robot without cables")
        F = self.columns.wrenches(poses) if self.columns.loads else None
        result = cable_stiffness(robot, self.columns.as_pose(poses), F)
        K, rank, status = stiffness_where_answered(result), result.rank, result.status_codes
        found: dict[str, np.ndarray] = {"rank": rank, "status": status}
        if Quantity.STIFFNESS in quantities:
            found["K"] = K
        if Quantity.PRINCIPAL_STIFFNESS in quantities:
            found |= principal_stiffnesses(K, definite=False)
        if Quantity.INDICES in quantities:
            found |= stiffness_indices(K, rank, self.length)
        if Quantity.TENSIONS in quantities:
            tensions = np.where(result.answered[:, None], result.tensions, np.nan)
            found["tension"] = tensions
            found["least_tension"] = tensions.min(axis=-1)
            found["greatest_tension"] = tensions.max(axis=-1)
        if not {Quantity.WORST_DEFLECTION, *self.of_wrench} & set(quantities):
            return found
        stable = (rank == robot.space.size) & ((status & int(Status.UNSTABLE)) == 0)
        C = np.full_like(K, np.nan)
        C[stable] = scaled_inverse(K[stable], result.placed.characteristic_length[stable])
        if Quantity.WORST_DEFLECTION in quantities:
            found |= worst_deflection(C)
        if self.wrench and self.of_wrench:
            found |= _under_wrench(robot, result, C, np.array(self.wrench))
        return {name: found[name] for name in (v.name for v in self.variables)}

    @property
    def of_wrench(self) -> tuple[Quantity, ...]:
        """Quantities about a load on locked winches."""
        return tuple(quantity for quantity in self.quantities if quantity.needs_wrench)


def _under_wrench(
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
