"""Eq. (26) in numbers, and (27), (28) entry by entry."""

from __future__ import annotations

import numpy as np

from robostiff.elastostatics import aggregate_matrices

CASE_A = ([0, 60, 120, 180, 240, 300], [0, 60, 120, 180, 240, 300])
CASE_B = ([0, 120, 120, 240, 240, 360], [60, 60, 180, 180, 300, 300])


def leg_vectors(
    angles: tuple[list[int], list[int]], R: float, r: float, h: float
) -> tuple[np.ndarray, np.ndarray]:
    """u_i and v_i of eq. (26), a row each."""
    phi, psi = (np.radians(part) for part in angles)
    zero = np.zeros(6)
    u = np.stack(
        [r * np.cos(psi) - R * np.cos(phi), r * np.sin(psi) - R * np.sin(phi), zero + h], axis=-1
    )
    v = np.stack([-r * np.cos(psi), -r * np.sin(psi), zero], axis=-1)
    return u, v


def aggregated(
    angles: tuple[list[int], list[int]], K11: float, R: float, r: float, h: float
) -> np.ndarray:
    """Eq. (23) of every leg at its end, brought together by eq. (12)."""
    u, v = leg_vectors(angles, R, r, h)
    legs = np.zeros((6, 6, 6))
    legs[:, :3, :3] = [K11 * np.outer(row, row) / (row @ row) for row in u]
    return aggregate_matrices(list(legs), list(v))


def eq27(K11: float, R: float, r: float, h: float) -> np.ndarray:
    """Case A, with its own leg length L_A^2 = (R - r)^2 + h^2."""
    d, L2 = R - r, (R - r) ** 2 + h**2
    K = np.diag([d * d, d * d, 2 * h * h, r * r * h * h, r * r * h * h, 0.0])
    K[0, 4] = K[4, 0] = r * h * d
    K[1, 3] = K[3, 1] = -r * h * d
    return 3 * K11 / L2 * K


def eq28(K11: float, R: float, r: float, h: float) -> np.ndarray:
    """Case B, with its own leg length L_B^2 = R^2 - R r + r^2 + h^2."""
    d, b, L2 = R - r, R / 2 - r, R * R - R * r + r * r + h * h
    side = d * d + R * r
    K = np.diag([side, side, 2 * h * h, r * r * h * h, r * r * h * h, 1.5 * r * r * R * R])
    K[0, 4] = K[4, 0] = r * h * b
    K[1, 3] = K[3, 1] = -r * h * b
    return 3 * K11 / L2 * K
