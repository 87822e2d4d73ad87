"""The hexapod in numba: recursion (15) a leg in plain loops over poses, legs and joints.

Nothing is allocated in the loops. One thread and float64.
"""

from __future__ import annotations

import numpy as np
from batched_stiffness import K_ACTUATOR, Hexapod

from peers.way import Way


def numba_recursion(robot: Hexapod) -> Way:
    """K_C by eq. (15); ImportError where numba is missing."""
    import numba

    compiled = numba.njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
    cross, rotate, congruence, without = map(compiled, (_cross, _rotate, _congruence, _without))
    base, first_axis, platform = robot.base, robot.first_axis, robot.platform
    EA, EI, GJ = robot.E * robot.A, robot.E * robot.I, robot.G * robot.J
    unit = np.eye(3)

    @compiled
    def evaluate(rows: np.ndarray) -> np.ndarray:  # noqa: PLR0912 - calls would cost time
        out = np.zeros((21, rows.shape[1]))
        K, W, WK, tube = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
        axes, R, J, u = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(6), np.zeros(6)
        Rb, to_reference, moment = np.zeros(3), np.zeros(3), np.zeros(3)
        for n in range(rows.shape[1]):
            rotate(rows[3, n], rows[4, n], rows[5, n], R)
            for leg in range(6):
                L = 0.0
                for i in range(3):
                    Rb[i] = 0.0
                    for j in range(3):
                        Rb[i] += R[i, j] * platform[leg, j]
                    to_reference[i] = rows[i, n] - base[leg, i]
                    axes[0, i] = to_reference[i] + Rb[i]
                    L += axes[0, i] ** 2
                L = np.sqrt(L)
                for i in range(3):
                    axes[0, i] /= L
                cross(axes[0], first_axis[leg], axes[2])
                size = np.sqrt(axes[2, 0] ** 2 + axes[2, 1] ** 2 + axes[2, 2] ** 2)
                for i in range(3):
                    axes[2, i] /= size
                cross(axes[2], axes[0], axes[1])

                # rows: wrenches about the platform's origin of forces and moments of the tube
                for i in range(3):
                    cross(Rb, axes[i], moment)
                    for j in range(3):
                        W[i, j] = W[i + 3, j + 3] = axes[i, j]
                        W[i, j + 3] = moment[j]
                tube[0, 0] = 1 / (L / EA + 1 / K_ACTUATOR)
                tube[1, 1] = tube[2, 2] = 12 * EI / L**3
                tube[3, 3] = GJ / L
                tube[4, 4] = tube[5, 5] = 4 * EI / L
                tube[1, 5] = tube[5, 1] = -6 * EI / L**2
                tube[2, 4] = tube[4, 2] = 6 * EI / L**2
                congruence(W, tube, WK, K)

                for joint in range(5):
                    axis = unit[joint - 2] if joint > 1 else axes[2] if joint else first_axis[leg]
                    if joint < 2:
                        cross(axis, to_reference, moment)
                    else:
                        cross(Rb, axis, moment)  # axis x (reference - end)
                    for i in range(3):
                        J[i], J[i + 3] = moment[i], axis[i]
                    without(J, u, K)
                e = 0
                for i in range(6):
                    for j in range(i, 6):
                        out[e, n] += K[i, j]
                        e += 1
        return out

    return evaluate


def _cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


def _rotate(x: float, y: float, z: float, R: np.ndarray) -> None:
    """Rotation matrix of a rotation vector, through its quaternion."""
    angle = np.sqrt(x * x + y * y + z * z)
    by = 0.5 if angle == 0.0 else np.sin(angle / 2) / angle
    w, x, y, z = np.cos(angle / 2), by * x, by * y, by * z
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def _congruence(W: np.ndarray, inner: np.ndarray, half: np.ndarray, K: np.ndarray) -> None:
    """K = W^T inner W."""
    for i in range(6):
        for j in range(6):
            half[i, j] = 0.0
            for k in range(6):
                half[i, j] += inner[i, k] * W[k, j]
    for i in range(6):
        for j in range(6):
            K[i, j] = 0.0
            for k in range(6):
                K[i, j] += W[k, i] * half[k, j]


def _without(J: np.ndarray, u: np.ndarray, K: np.ndarray) -> None:
    """One step of (15): K becomes K - u u^T / mu."""
    mu = 0.0
    for i in range(6):
        u[i] = 0.0
        for j in range(6):
            u[i] += K[i, j] * J[j]
        mu += J[i] * u[i]
    for i in range(6):
        for j in range(6):
            K[i, j] -= u[i] * u[j] / mu
