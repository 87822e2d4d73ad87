"""The Jacobian of a single leg, from differences: where it is singular, and what moves alone."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.kinematics import place_chain
from robostiff.model import Robot

_STEP = 1e-6
#: Part of the largest singular value: near a singularity, and the little that a fine screw moves.
_NEAR, _FINE = 1e-3, 1e-6


def is_free(robot: Robot, q: np.ndarray) -> bool:
    """Whether the end can stay while joints move."""
    J, free = _jacobian(robot, q)
    return _rank(J, _NEAR) < len(free)


def _jacobian(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """About the end of the leg, by central differences; and places of its columns in q."""
    leg = robot.legs[0]
    free = np.flatnonzero(leg.chain.free)
    shifts = np.zeros((1 + 2 * len(free), len(q)))
    for k, place in enumerate(free):
        shifts[1 + 2 * k, place], shifts[2 + 2 * k, place] = _STEP, -_STEP
    end = place_chain(leg.chain, q + shifts, leg.base.R, leg.base.p)
    turns = Rotation.from_matrix(end.R[0].T @ end.R).as_rotvec()
    gaps = np.hstack([(end.p - end.p[0]) @ end.R[0], turns])
    return (gaps[1::2] - gaps[2::2]).T / (2 * _STEP), free


def _rank(J: np.ndarray, part: float) -> int:
    if 0 in J.shape:
        return 0
    values = np.linalg.svd(J, compute_uv=False)
    return int(np.count_nonzero(values > part * values[0]))
