"""The Jacobian of a single leg, from differences: where it is singular, and what moves alone."""

from __future__ import annotations

import numpy as np

from robostiff.model import Actuated, Robot
from tests.campaign.walk import end_of, frame_of, gap

_STEP = 1e-6
#: Part of the largest singular value: near a singularity, and the little that a fine screw moves.
_NEAR, _FINE = 1e-3, 1e-6


def is_free(robot: Robot, q: np.ndarray) -> bool:
    """Whether the end can stay while joints move."""
    return _rank_and_sign(robot, q)[0] < int(np.count_nonzero(robot.legs[0].chain.free))


def drives_are_free(robot: Robot, q: np.ndarray) -> bool:
    """Whether the end can stay while drives move."""
    roles = robot.legs[0].chain.roles
    J, free = _jacobian(robot, q)
    passive = np.array([not isinstance(roles[place], Actuated) for place in free], dtype=bool)
    return _rank(J, _FINE) < _rank(J[:, passive], _FINE) + int(np.count_nonzero(~passive))


def is_regular(robot: Robot, home: np.ndarray, q: np.ndarray) -> bool:
    """Whether the way from home to q, straight in coordinates, keeps away from singularities."""
    return len({_rank_and_sign(robot, home + t * (q - home)) for t in np.linspace(0, 1, 9)}) == 1


def _jacobian(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """About the end of the leg, by central differences; and places of its columns in q."""
    leg = robot.legs[0]
    free = np.flatnonzero(leg.chain.free)
    shifts = np.zeros((1 + 2 * len(free), len(q)))
    for k, place in enumerate(free):
        shifts[1 + 2 * k, place], shifts[2 + 2 * k, place] = _STEP, -_STEP
    T, _ = end_of(leg.chain, q + shifts, frame_of(leg.base))
    gaps = gap(T, T[:1])
    return (gaps[1::2] - gaps[2::2]).T / (2 * _STEP), free


def _rank(J: np.ndarray, part: float) -> int:
    if 0 in J.shape:
        return 0
    values = np.linalg.svd(J, compute_uv=False)
    return int(np.count_nonzero(values > part * values[0]))


def _rank_and_sign(robot: Robot, q: np.ndarray) -> tuple[int, float]:
    """Rank, and the sign of the determinant of a square Jacobian alone."""
    J, free = _jacobian(robot, q)
    square = len(free) == 6 and robot.space.size == 6
    return _rank(J, _NEAR), float(np.sign(np.linalg.det(J))) if square else 1.0
