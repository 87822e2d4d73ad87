"""Where a rod that is turned by half a turn about itself is still the same rod."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robostiff.kinematics.frames import place_chain
from robostiff.kinematics.jacobians import leg_compliance, passive_jacobian
from robostiff.model import Chain, Motion, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.spatial import block_rotation

_SAME = 1e-9


def half_turn_matters(
    chain: Chain, between: tuple[int, int], point: np.ndarray, along: np.ndarray
) -> bool:
    """Whether a half turn about a line changes the elasticity of a part of a leg.

    Parameters
    ----------
    chain : Chain
        Of floats.
    between : (int, int)
        The part: elements after so many elementary joints, and before the joint of that place.
    point, along : (3,) arrays
        A point and the unit direction of the line, in the leg's base frame at zero coordinates.
    """
    turn = block_rotation(2.0 * np.outer(along, along) - np.eye(3))
    return any(_changed(element, point, turn) for element in _part(chain, between))


def has_springs(chain: Chain, joints: int) -> bool:
    """Whether an elastic part follows after so many elementary joints, before the next."""
    part = _part(chain, (joints, joints))
    return any(isinstance(element, PlacedSpring) for element in part)


def _part(chain: Chain, between: tuple[int, int]) -> Iterator[PlacedFreedom | PlacedSpring]:
    # Slides at home, because beams of no length have no elasticity; they run along the line.
    slides = np.array([freedom.motion is Motion.TRANSLATION for freedom in chain.freedoms])
    q = np.where(chain.free & ~slides, 0.0, chain.home)
    joints = 0
    for element in place_chain(chain, q, np.eye(3), np.zeros(3)).parts:
        is_last_joint = joints == between[1] and isinstance(element, PlacedFreedom)
        if between[0] <= joints <= between[1] and not is_last_joint:
            yield element
        joints += isinstance(element, PlacedFreedom)


def _changed(element: PlacedFreedom | PlacedSpring, point: np.ndarray, turn: np.ndarray) -> bool:
    alone = PlacedLeg("", (element,), point)
    C, (J_q, _) = leg_compliance(alone, point), passive_jacobian(alone, point)
    # shifts and turns in their own units
    size = np.sqrt(np.diagonal(C)).reshape(2, 3).max(axis=1).repeat(3)
    if np.any(np.abs(turn @ C @ turn.T - C) > _SAME * np.outer(size, size)):
        return True
    both = np.concatenate([J_q, turn @ J_q], axis=-1)
    return _rank(both) > _rank(J_q)


def _rank(J: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(J, tol=_SAME)) if J.size else 0
