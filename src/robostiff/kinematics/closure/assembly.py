"""Assembly modes of closed forms: the signs of their roots, and the posture nearest to another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product as combinations
from typing import Any

import numpy as np

from robostiff.kept import kept
from robostiff.kinematics.frames import beam_lengths
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Chain, Joint, JointKind, Locked

_DIGITS = 9  # to which two distances from home count as equal


@dataclass(frozen=True)
class RootSigns:
    """Signs, each 1 or -1, of the roots that a closed form takes; a smooth path keeps them."""

    root: Any = 1  # gives the length of a strut, or the coordinate of a slide or crank
    # of the triple product ``b.(a x d)`` at the joint on the near and the far end of the rod, for
    # the axis b that keeps its angles to two known directions a and d
    first: Any = 1
    second: Any = 1


def all_modes(signs: tuple[bool, bool, bool]) -> tuple[RootSigns, ...]:
    """The modes of a closed form that has some of the three signs.

    Examples
    --------
    >>> len(all_modes((True, False, True)))
    4
    """
    return tuple(
        RootSigns(*own) for own in combinations(*((1, -1) if two else (1,) for two in signs))
    )


def in_one(modes: tuple[RootSigns, ...], count: int) -> RootSigns:
    """Modes as one of arrays, each sign for `count` poses, mode after mode."""
    signs = np.array([(mode.root, mode.first, mode.second) for mode in modes])
    return RootSigns(*np.repeat(signs, count, axis=0).T)


def nearest(
    chain: Chain,
    q: np.ndarray,
    closed: np.ndarray,
    near: np.ndarray,
    given: np.ndarray,
    leading: int,
    length: float,
) -> np.ndarray:
    """Which of some postures (m, N, size) is nearest to a wanted one: (N,) of int.

    Those that close the leg come first. Then those whose drive is within its limits, where its home
    was left out; then the nearest in the coordinates that are given; then in that of the drive;
    then in all. Distances are 1 - cos of an angle, and advances as parts of the length.

    Parameters
    ----------
    chain : Chain
        Its main path alone counts.
    q : (m, N, size) array
        Coordinates of each posture.
    closed : (m, N) array of bool
        Where it closes the leg.
    near : (size,) array
        Wanted coordinates [m, rad].
    given : (size,) array of bool
        Which of those of the main path were chosen, and not left out.
    leading : int
        Place of the drive's coordinate on the main path.
    length : float
        Against which slides are measured [m].
    """
    chain, q, near = chain.main_path, q[..., chain.main_places], near[chain.main_places]
    difference = q - near
    apart = np.empty(difference.shape)
    for place, screw in enumerate(chain.freedoms):
        x = difference[..., place]
        shift = np.abs(screw.advance(x)) / length
        apart[..., place] = shift if screw.slides else 1.0 - np.cos(x)
    for place in _balls(chain):
        chord = turn_by_vector(q[..., place]) - turn_by_vector(near[place])
        apart[..., place] = np.einsum("...ij,...ij->...", chord, chord)[..., None] / 12.0
    low, high = chain.limits[:, leading]
    outside = ((q[..., leading] < low) | (q[..., leading] > high)) & (not given[leading])
    keys = (np.sum(apart, axis=-1), apart[..., leading], np.sum(apart[..., given], axis=-1))
    rounded = [np.round(key, _DIGITS) for key in keys]
    # The last key is the first to decide; equal ones keep their order.
    return np.lexsort((*rounded, outside, shortened(chain, q), ~closed), axis=0)[0]


def shortened(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Where a beam of a telescope would have no positive length (...)."""
    short = np.zeros(q.shape[:-1], dtype=bool)
    for length in beam_lengths(chain, q):
        short |= length <= 0
    return short


def beyond_limits(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Where an actuator is beyond its limits (...)."""
    low, high = chain.limits
    return np.any((q < low) | (q > high), axis=-1)


def on_turn_of_home(chain: Chain, q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same angles, each on the turn within its limits, or else nearest to given coordinates.

    A joint that slides while it turns is elsewhere after a full turn, and so is what follows a
    joint by a gear: they keep their coordinates. q (N, size) is changed in place.
    """
    places, low, high, balls = _turning(chain)
    if places.size:
        own, one = q[..., places], 2.0 * np.pi
        turns = np.round((np.minimum(np.maximum(near[places], low), high) - own) / one)
        found = own + one * turns
        turns += (found < low) & (found + one <= high)
        turns -= (found > high) & (found - one >= low)
        q[..., places] += one * turns
    for place in balls:  # rotation vectors of the same rotations
        r, own = q[..., place], near[place]
        size, far = np.linalg.norm(r, axis=-1, keepdims=True), np.linalg.norm(own)
        still = own / far if far > 0 else np.zeros(3)
        direction = np.where(size > 0, r / np.where(size > 0, size, 1.0), still)
        turns = np.round(np.sum((own - r) * direction, axis=-1, keepdims=True) / (2.0 * np.pi))
        r += 2.0 * np.pi * turns * direction
    return q


@kept
def _turning(chain: Chain) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[slice]]:
    """Places of coordinates that count full turns, their limits, and spherical joints."""
    balls = list(_balls(chain))
    of_balls = {i for place in balls for i in range(place.start, place.stop)}
    places = [
        i
        for i, screw in enumerate(chain.freedoms)
        if screw.is_rotation and i not in of_balls and chain.free[i]
    ]
    return np.array(places, dtype=int), *chain.limits[:, places], balls


def _balls(chain: Chain) -> Iterator[slice]:
    """Places of the spherical joints that move."""
    for element, place in chain.moving:
        is_ball = isinstance(element, Joint) and element.kind is JointKind.SPHERICAL
        if is_ball and not isinstance(element.role, Locked):
            yield place
