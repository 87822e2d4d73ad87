"""The hexapod in JAX: recursion (15) a leg, `vmap` over legs and poses, compiled by `jit`.

Float64, and the one processor that `kernels.py` leaves to XLA.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from batched_stiffness import K_ACTUATOR, Hexapod

from peers.way import PLACES, Way

CHUNK = 250  # poses that XLA gets at once; fewer or more are slower here


def jax_recursion(robot: Hexapod) -> Way:
    """K_C by eq. (15); ImportError where JAX is missing."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    legs = tuple(jnp.asarray(part) for part in (robot.base, robot.first_axis, robot.platform))

    def at_pose(pose: Any) -> Any:
        R = _rotation(jnp, pose[3:])
        of_legs = jax.vmap(lambda A, first, b: _leg(jnp, robot, pose[:3], R, A, first, b))
        return of_legs(*legs).sum(axis=0)[PLACES]

    compiled = jax.jit(jax.vmap(at_pose, in_axes=1, out_axes=1))

    def evaluate(rows: np.ndarray) -> np.ndarray:
        parts = range(0, rows.shape[1], CHUNK)
        return np.concatenate(
            [np.asarray(compiled(rows[:, at : at + CHUNK])) for at in parts], axis=1
        )

    return evaluate


def _rotation(jnp: Any, r: Any) -> Any:
    """Rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = jnp.sqrt(r @ r)
    X = jnp.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    half = jnp.sinc(angle / 2 / jnp.pi)
    return jnp.eye(3) + jnp.sinc(angle / jnp.pi) * X + 0.5 * half**2 * (X @ X)


def _leg(jnp: Any, robot: Hexapod, p: Any, R: Any, A: Any, first: Any, b: Any) -> Any:
    """K of a leg about the platform's origin: that of its tube, then joint after joint."""
    Rb = R @ b
    along = p + Rb - A
    L = jnp.sqrt(along @ along)
    x = along / L
    z = jnp.cross(x, first)
    z = z / jnp.sqrt(z @ z)
    axes = jnp.stack([x, jnp.cross(z, x), z], axis=1)
    zero = jnp.zeros((3, 3))
    # from forces at the platform's origin to those at the end of the tube, in its axes
    moments = jnp.cross(Rb[:, None], axes, axisa=0, axisb=0, axisc=0)
    wrench = jnp.block([[axes, zero], [moments, axes]])
    K = wrench @ _tube_stiffness(jnp, robot, L) @ wrench.T
    unit = jnp.eye(3)
    twists = [
        jnp.concatenate([jnp.cross(axis, p - point), axis])
        for axis, point in ((first, A), (z, A), *((unit[i], p + Rb) for i in range(3)))
    ]
    for J in twists:
        u = K @ J
        K = K - jnp.outer(u, u) / (J @ u)
    return K


def _tube_stiffness(jnp: Any, robot: Hexapod, L: Any) -> Any:
    """Stiffness of tube and actuator in the axes of the tube, x along it."""
    EA, EI, GJ = robot.E * robot.A, robot.E * robot.I, robot.G * robot.J
    a, t, o = 1 / (L / EA + 1 / K_ACTUATOR), GJ / L, 0.0
    s, m, e = 12 * EI / L**3, 6 * EI / L**2, 4 * EI / L
    return jnp.array(
        [
            [a, o, o, o, o, o],
            [o, s, o, o, o, -m],
            [o, o, s, o, m, o],
            [o, o, o, t, o, o],
            [o, o, m, o, e, o],
            [o, -m, o, o, o, e],
        ]
    )
