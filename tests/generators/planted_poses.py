"""Poses that try a compiled robot hard: singular, at the limit of reach, beyond it, and near."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robostiff.analysis import stiffness
from robostiff.elastostatics import Status
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

    def near_home(self, rng: np.random.Generator) -> np.ndarray:
        """Home, and 1e-3 to 1e-12 away from it."""
        return np.concatenate([self.home[None], *self._around(self.home[None], rng)])

    def planted(self, rng: np.random.Generator, lines: int = 12) -> np.ndarray:
        """Coordinates on singularities and limits found along lines from home, and near them."""
        towards = self.home + rng.normal(size=(lines, self.home.size)) * self.step
        found = [self.home[None]]
        for status in (Status.UNREACHABLE, Status.BEYOND_LIMITS):
            found.append(self._where_it_begins(towards, status))
        found.append(self._most_singular(towards))
        places = np.concatenate([*found, self.round_values()])
        return np.concatenate([places, *(self._around(places, rng))])

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

    def _where_it_begins(self, towards: np.ndarray, bit: Status) -> np.ndarray:
        def has(rows: np.ndarray) -> np.ndarray:
            return stiffness(self.robot, self.pose(rows)).status_codes & int(bit) != 0

        low = np.zeros((len(towards), 1))
        high = np.ones((len(towards), 1))
        crossing = has(towards) & ~has(np.tile(self.home, (len(towards), 1)))
        towards, low, high = towards[crossing], low[crossing], high[crossing]
        if not len(towards):
            return np.empty((0, self.home.size))
        for _ in range(52):
            middle = 0.5 * (low + high)
            beyond = has(self.home + middle * (towards - self.home))[:, None]
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return np.concatenate([self.home + t * (towards - self.home) for t in (low, high)])

    def _most_singular(self, towards: np.ndarray) -> np.ndarray:
        """Where K is nearest to singular along lines, by golden sections."""

        def worth(t: np.ndarray) -> np.ndarray:
            rows = self.home + t * (towards - self.home)
            result = stiffness(self.robot, self.pose(rows))
            K = result.details().matrix
            return _regularity(np.where(result.answered[:, None, None], K, np.nan))

        grid = np.linspace(0, 1, 41)
        values = np.array([worth(np.full((len(towards), 1), t)) for t in grid])
        best = grid[np.argmin(values, axis=0)][:, None]
        low, high = best - 0.025, best + 0.025
        return self.home + _least(worth, low, high) * (towards - self.home)


def _least(worth: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray):
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(45):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        left = (worth(a) < worth(b))[:, None]
        low, high = np.where(left, low, a), np.where(left, b, high)
    return 0.5 * (low + high)


def _regularity(K: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of K scaled to a unit diagonal that is not zero by rank."""
    size = np.sqrt(np.einsum("...ii->...i", np.nan_to_num(K)))
    size = np.where(size > 0, size, 1.0)
    values = np.linalg.eigvalsh(np.nan_to_num(K) / (size[:, :, None] * size[:, None, :]))
    return np.where(np.isfinite(K[:, 0, 0]), values[:, 0], 2.0)
