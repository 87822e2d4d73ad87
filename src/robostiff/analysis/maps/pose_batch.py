"""The stiffness of a robot at some poses, with NaN where there is none, and its load case."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robostiff.analysis.maps.pose_columns import PoseColumns
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import stiffness
from robostiff.analysis.where_answered import (
    compliance_where_answered,
    origin_to_reference,
    stiffness_where_answered,
)
from robostiff.elastostatics import CartesianStiffness, scaling
from robostiff.model import Robot
from robostiff.spatial import move_twist, move_wrench

# As in `deflection`: a load with less than this part of it on a free motion is balanced.
_BALANCED = 1e-9


class PoseBatch:
    """What the quantities of a map are computed from, each step once.

    Parameters
    ----------
    robot : Robot
    columns : PoseColumns
    poses : (N, n_coordinates) array
        [m, rad].
    """

    def __init__(self, robot: Robot, columns: PoseColumns, poses: np.ndarray) -> None:
        self.robot = robot
        self.columns = columns
        self.poses = poses

    @cached_property
    def result(self) -> RobotStiffness:
        """Stiffness at all poses."""
        return stiffness(self.robot, self.columns.as_pose(self.poses))

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
        """Compliance matrices (N, n, n); NaN where there is none or free motions remain."""
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
        twist = np.einsum("...ij,j->...i", self.compliance, wrench)
        unbalanced = np.zeros(len(twist), dtype=bool)
        if self.result.serial_compliance is not None:
            return twist, unbalanced
        held = self.result.answered & (self.rank < self.robot.space.size)
        for rank in np.unique(self.rank[held]):
            rows = np.flatnonzero(held & (self.rank == rank))
            about = self.result.about_reference[rows]
            to_origin = -self.offset[rows]
            F = move_wrench(np.broadcast_to(wrench, (len(rows), len(wrench))), to_origin)
            t, drives = held_twists(about, F, int(rank))
            twist[rows] = move_twist(t, -to_origin)
            unbalanced[rows] = drives
        return twist, unbalanced


def held_twists(
    held: CartesianStiffness, F: np.ndarray, rank: int
) -> tuple[np.ndarray, np.ndarray]:
    """Least twists under wrenches at poses of one rank, and where a load drives a free motion.

    K restricted to the span of the wrenches that hold the platform is inverted there.

    Parameters
    ----------
    held : CartesianStiffness
        At N poses.
    F : (N, n) array
    rank : int

    Returns
    -------
    twist : (N, n) array
        NaN where the load drives a free motion.
    unbalanced : (N,) array of bool
    """
    s = scaling(held.length, held.space)
    F_scaled = F / s
    U = np.linalg.svd(held.held)[0]
    H, free = U[..., :rank], U[..., rank:]
    on_free = np.linalg.norm(np.einsum("kij,ki->kj", free, F_scaled), axis=-1)
    unbalanced = on_free > _BALANCED * np.linalg.norm(F_scaled, axis=-1)
    K = held.matrix / (s[:, :, None] * s[:, None, :])
    K_held = np.einsum("kia,kij,kjb->kab", H, K, H, optimize=True)
    load = np.einsum("kia,ki->ka", H, F_scaled)
    twist = np.einsum("kia,ka->ki", H, np.linalg.solve(K_held, load[..., None])[..., 0]) / s
    return np.where(unbalanced[:, None], np.nan, twist), unbalanced
