"""The energy of a platform in cables in 50 digits, written without the library."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp, mpf

mp.dps = 50
STEP = mpf(10) ** -12


def exponential(r: list[Any]) -> Any:
    """Rotation matrix of a small rotation vector, by the series of the matrix exponential."""
    S = mp.matrix([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    R, term = mp.eye(3), mp.eye(3)
    for k in range(1, 7):
        term = term * S / k
        R += term
    return R


def point_of(reference: np.ndarray, arm: np.ndarray, x: list[Any]) -> Any:
    """Where a point of the platform is after a displacement x of the reference point."""
    turned = exponential(x[3:]) * mp.matrix([mpf(float(a)) for a in arm])
    return [mpf(float(reference[i])) + x[i] + turned[i] for i in range(3)]


def energy(placed: Any, axial: np.ndarray, tensions: np.ndarray, x: list[Any]) -> Any:
    """Elastic energy of the cables, and potential of the weight, after a displacement (6)."""
    total = mpf(0)
    reference = placed.reference_point
    for i, exit_point in enumerate(placed.exit_points):
        arm = placed.attachments[i] - reference

        def length(y: list[Any], exit_point: Any = exit_point, arm: Any = arm) -> Any:
            end = point_of(reference, arm, y)
            return mp.sqrt(sum((end[j] - mpf(float(exit_point[j]))) ** 2 for j in range(3)))

        k, t = mpf(float(axial[i])), mpf(float(tensions[i]))
        stretch = length(x) - length([mpf(0)] * 6) + t / k
        total += k * stretch**2 / 2
    at = point_of(reference, placed.weight_point - reference, x)
    return total - sum(mpf(float(placed.weight_force[j])) * at[j] for j in range(3))


def hessian(placed: Any, axial: np.ndarray, tensions: np.ndarray) -> np.ndarray:
    """Second derivative of the energy (6, 6) by central differences."""

    def at(*moves: tuple[int, int]) -> Any:
        x = [mpf(0)] * 6
        for place, sign in moves:
            x[place] += sign * STEP
        return energy(placed, axial, tensions, x)

    H = np.zeros((6, 6))
    for i in range(6):
        for j in range(i, 6):
            terms = [a * b * at((i, a), (j, b)) for a in (1, -1) for b in (1, -1)]
            H[i, j] = H[j, i] = float(sum(terms) / (4 * STEP**2))
    return H
