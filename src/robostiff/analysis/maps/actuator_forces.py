"""Loads on the actuators under a wrench, at many poses at once."""

from __future__ import annotations

import numpy as np

from robostiff.analysis.leg_loads import leg_loads
from robostiff.analysis.maps.pose_batch import PoseBatch
from robostiff.kinematics import find_posture, freedom_twist
from robostiff.model import Actuated
from robostiff.spatial import move_wrench
from robostiff.spatial.batch import empty_batch


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
    result = batch.result
    known = np.isfinite(twist[:, 0])
    whole = np.broadcast_to(wrench, (len(twist), len(wrench)))
    loads = leg_loads(result[known], move_wrench(whole, -batch.offset)[known])
    posture = find_posture(batch.robot, batch.columns.as_pose(batch.poses))
    rows = list(batch.robot.space.rows)
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
