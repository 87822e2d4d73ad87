"""Mobility of the platform: the motions that the legs allow when every drive may move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.closure import loops_of_legs
from robostiff.model import ALL_COORDINATES, Coordinate, Robot

_INDEPENDENT = 1e-6


def platform_mobility(
    robot: Robot,
    pose: np.ndarray,
    q: Sequence[np.ndarray],
    length: float,
    held: Sequence[np.ndarray] = (),
) -> np.ndarray:
    """Rates of the pose coordinates (6,) that the legs leave free at coordinates q of each.

    They are the pose part of what keeps all loops closed. Orthonormal columns (6, f), rotations
    multiplied by the length [m]. Of each leg coordinates at some places may be held.
    """
    loops = loops_of_legs(robot.legs, range(6), length, held)
    _, values, V_T = np.linalg.svd(loops.rates(np.concatenate([pose, *q])[None])[0])
    free = V_T[np.count_nonzero(values > _INDEPENDENT) :, -6:].T
    U, values, _ = np.linalg.svd(free)
    return U[:, : np.count_nonzero(values > _INDEPENDENT)]


def fitting_coordinates(mobility: np.ndarray) -> tuple[Coordinate, ...]:
    """Pose coordinates that determine the pose, the ones that move most (f of them)."""
    rest = mobility.copy()
    chosen: list[int] = []
    for _ in range(mobility.shape[1]):
        sizes = np.linalg.norm(rest, axis=-1)
        sizes[chosen] = -1.0
        # The first that is nearly as large as the largest keeps x before y before z.
        best = int(np.argmax(sizes > 0.9 * sizes.max()))
        chosen.append(best)
        rest = rest - np.outer(rest @ rest[best], rest[best]) / (rest[best] @ rest[best])
    return tuple(ALL_COORDINATES[k] for k in sorted(chosen))


def determine_pose(mobility: np.ndarray, coordinates: Sequence[Coordinate]) -> bool:
    """Whether as many coordinates as freedoms are chosen, and they are independent."""
    if len(coordinates) != mobility.shape[1]:
        return False
    rows = [ALL_COORDINATES.index(coordinate) for coordinate in coordinates]
    values = np.linalg.svd(mobility[rows], compute_uv=False)
    return bool(np.all(values > _INDEPENDENT))
