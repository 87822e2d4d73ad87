"""Loads on the actuators under a wrench, at many poses at once."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.maps.pose_batch import PoseBatch
from robostiff.kinematics import find_posture, freedom_twist
from robostiff.model import Actuated
from robostiff.spatial import move_twist, move_wrench
from robostiff.spatial.batch import empty_batch


def actuator_forces(batch: PoseBatch, twist: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Load on each actuator along its coordinate (N, actuators) [N or N m].

    A leg carries F_leg = K_leg t, of which an actuator feels the part along its own motion.

    Parameters
    ----------
    batch : PoseBatch
    twist : (N, n) array
        Of the reference point under the wrench; NaN where there is none.
    wrench : (n,) array
        About the reference point.
    """
    result = batch.result
    t_origin = move_twist(twist, -batch.offset)
    posture = find_posture(batch.robot, batch.columns.as_pose(batch.poses))
    rows = list(batch.robot.space.rows)
    loads = []
    for leg, stiffness_of_leg in zip(posture.snapshot.legs, result.legs, strict=True):
        if result.serial_compliance is not None:
            own = move_wrench(np.broadcast_to(wrench, t_origin.shape), -batch.offset)
        else:
            own = np.einsum("...ij,...j->...i", stiffness_of_leg.matrix, t_origin)
        for freedom in leg.freedoms:
            if isinstance(freedom.role, Actuated):
                column = freedom_twist(freedom, result.origin)[..., rows]
                loads.append(np.einsum("...i,...i->...", column, own))
    out = empty_batch((len(twist),), (len(loads),))
    known = np.isfinite(twist[:, 0])
    for k, load in enumerate(loads):
        out[:, k] = np.where(known, load, np.nan)
    return out
