"""The Jacobian of a single leg, from differences: where it is singular, and what moves alone."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.kinematics import place_chain
from robostiff.model import Actuated, Robot

_STEP = 1e-6
#: Part of the largest singular value: near a singularity, and the little that a fine screw moves.
_NEAR, _FINE = 1e-3, 1e-6


def is_free(robot: Robot, q: np.ndarray) -> bool:
    """Whether the end can stay while joints move."""
    J, free = _jacobian(robot, q)
    return _rank(J, _NEAR) < len(free)


def drives_are_free(robot: Robot, q: np.ndarray) -> bool:
    """Whether the end can stay while drives move."""
    roles = robot.legs[0].chain.roles
    J, free = _jacobian(robot, q)
    passive = np.array([not isinstance(roles[place], Actuated) for place in free], dtype=bool)
    return _rank(J, _FINE) < _rank(J[:, passive], _FINE) + int(np.count_nonzero(~passive))


def is_regular(robot: Robot, home: np.ndarray, q: np.ndarray) -> bool:
    """Whether the way from home to q, straight in coordinates, keeps away from singularities.

    One that lies between two places turns the columns of J over: det(J_1^T J_2) changes its sign.
    """
    ways = [_jacobian(robot, home + t * (q - home))[0] for t in np.linspace(0, 1, 9)]
    ranks = {_rank(J, _NEAR) for J in ways}
    if len(ranks) > 1:
        return False
    size = ways[0].shape[1]
    if ranks != {size}:  # joints move alone all the way, or nearly so, where modes are near
        return all(_rank(J, _FINE) < size for J in ways)
    return all(np.linalg.det(J.T @ after) > 0 for J, after in itertools.pairwise(ways))


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
