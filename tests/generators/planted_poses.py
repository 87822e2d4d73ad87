"""Poses that try a compiled robot hard: near home, far from it, and at round values."""

from __future__ import annotations

import numpy as np

from robostiff.kinematics import JointCoordinates, Pose, PostureFinder
from robostiff.model import ALL_COORDINATES, Robot

NEAR = np.array([0.0, *(10.0**-k for k in range(3, 13))])


class PoseSpace:
    """The free coordinates of a robot: where home is, and how large a step is."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        finder = PostureFinder(robot)
        self.by_joints = robot.is_serial and robot.home is None
        if self.by_joints:
            self.home = robot.legs[0].chain.home
            self.step = np.ones(self.home.size)
        else:
            places = [ALL_COORDINATES.index(c) for c in robot.coordinates]
            self.home = finder.home_pose[places]
            self.step = np.where(np.array(places) < 3, finder.length, 1.0)

    def pose(self, rows: np.ndarray) -> Pose:
        """Coordinates as the library wants them."""
        return JointCoordinates(rows) if self.by_joints else rows

    def drawn(self, rng: np.random.Generator, count: int, size: float = 1.0) -> np.ndarray:
        """Random coordinates about home, some of them out of reach."""
        shifts = rng.uniform(-1, 1, (count, self.home.size)) * self.step
        return self.home + size * shifts * rng.uniform(0, 1, (count, 1))

    def beside(self, count: int, size: float, seed: int = 1) -> np.ndarray:
        """Random coordinates that differ from home's by up to a part of the length, or radians."""
        random = np.random.default_rng(seed).uniform(-1, 1, (count, self.home.size))
        return self.home + size * self.step * random

    def near_home(self, rng: np.random.Generator) -> np.ndarray:
        """Home, and 1e-3 to 1e-12 away from it."""
        return np.concatenate([self.home[None], *self._around(self.home[None], rng)])

    def round_values(self) -> np.ndarray:
        """Home with some coordinates at round values."""
        rows = []
        for k, step in enumerate(self.step):
            for shift in (-np.pi / 2, -0.5, -0.1, 0.1, 0.5, np.pi / 2):
                row = self.home.copy()
                row[k] += shift * step if self.step[k] == 1.0 else shift * step / 2
                rows.append(row)
            zeroed = self.home.copy()
            zeroed[k] = 0.0
            rows.append(zeroed)
        return np.array([*rows, np.zeros(self.home.size)])

    def _around(self, places: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
        return [
            places + size * self.step * rng.choice([-1.0, 0.0, 1.0], places.shape)
            for size in NEAR[1:]
        ]
