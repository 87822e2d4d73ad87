"""The stiffness of a robot at some poses, with NaN where there is none, and its load case."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robostiff.analysis.guarded_values import twists_under
from robostiff.analysis.maps.pose_columns import PoseColumns
from robostiff.analysis.result import RobotStiffness
from robostiff.analysis.stiffness_at_pose import stiffness
from robostiff.analysis.where_answered import (
    compliance_where_answered,
    origin_to_reference,
    stiffness_where_answered,
)
from robostiff.model import Robot


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
