"""Mobility of the platform: the motions that the legs allow when every drive may move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robostiff.kinematics.closure import closing_rates
from robostiff.kinematics.frames import PlacedChain, place_chain
from robostiff.kinematics.jacobians import freedom_twists
from robostiff.kinematics.turn import rotvec_rate
from robostiff.model import ALL_COORDINATES, Coordinate, Leg, Robot

_INDEPENDENT = 1e-6


def platform_mobility(
    robot: Robot, pose: np.ndarray, q: Sequence[np.ndarray], length: float
) -> np.ndarray:
    """Rates of the pose coordinates (6,) that the legs leave free at coordinates q of each.

    Orthonormal columns (6, f), rotations multiplied by the length [m].
    """
    scale = np.array([1.0, 1.0, 1.0, length, length, length])
    held = []
    for leg, own in zip(robot.legs, q, strict=True):
        placed = place_chain(leg.chain, own, leg.base.R, leg.base.p)
        held.append(_complement(_end_motions(leg, placed, pose[:3], scale)))
    freedoms = _complement(np.concatenate(held, axis=-1))
    rates = np.eye(6)
    rates[3:, 3:] = np.linalg.inv(rotvec_rate(pose[3:]))
    return np.linalg.qr(scale[:, None] * (rates @ (freedoms / scale[:, None])))[0]


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


def _end_motions(leg: Leg, placed: PlacedChain, at: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Twists that a leg can give to its end, its loops kept closed; scaled columns (6, m).

    Motions of joints have the size one. Rows are not scaled: in loops of which all axes meet, some
    rows are rounding.
    """
    freedoms, free = placed.freedoms, leg.chain.free
    J = np.zeros((6, len(freedoms)))
    main = leg.chain.main_places
    J[:, main] = freedom_twists([freedoms[i] for i in main], at)
    opening = [closing_rates(loop, placed) for loop in placed.loops]
    rates = np.stack([J, *opening])[:, :, free] * scale[:, None]
    sizes = np.linalg.norm(rates, axis=(0, 1))
    rates = rates / np.where(sizes > 0, sizes, 1.0)
    return rates[0] @ _complement(rates[1:].reshape(6 * len(opening), rates.shape[-1]).T)


def _complement(columns: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the complement of the columns."""
    if columns.shape[-1] == 0:
        return np.eye(columns.shape[0])
    U, values, _ = np.linalg.svd(columns)
    return U[:, np.count_nonzero(values > _INDEPENDENT) :]
