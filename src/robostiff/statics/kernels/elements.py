"""Elements of loaded chains on recorded entries: joints, springs, and beams with their bowing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.record import is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import bending_planes, bowing, part_of_beam
from robostiff.statics.chains.element import FiniteSpring
from robostiff.statics.chains.spring_elements import among_motions

# Of the product of two diagonal entries of a compliance: a square beside it that is rounding.
_LOST = 1e-20


@dataclass(frozen=True)
class RecordedJoint:
    """A joint that moves by q along its screw, at the unloaded posture; see `FiniteJoint`."""

    # (3,) of entries and numbers
    point: np.ndarray
    axis: np.ndarray
    turns: bool
    slide: Any  # entry or number: shift for each unit of q
    stiffness: Any  # entry or number: 0 where it is passive
    # entry or number: with which it pushes along its coordinate at q = 0 [N or N m]
    preload: Any = 0

    size = 1

    def sample_sizes(self, length: float) -> list[float]:
        """A unit of motion of its coordinate: a radian, or the length of the robot."""
        return [1.0 if self.turns else length]

    @property
    def springs(self) -> list[Any]:
        """Stiffness of its coordinate, 0 of a passive one."""
        return [self.stiffness]


@dataclass(frozen=True)
class RecordedSpring:
    """An elastic part, ``(d, r) = V y`` with the energy ``sum(k y^2) / 2``; see `FiniteSpring`."""

    point: np.ndarray  # (3,) of entries and numbers: its far end at the unloaded posture
    rotation: np.ndarray  # (3, 3) of entries and numbers: its own axes
    # (6, m) of entries and numbers: V, each column of about the length of the robot or a radian
    modes: np.ndarray
    stiffness: list[Any]  # entries and numbers: k, 0 along a freedom
    axial: Any  # entry or number: EA/L of a beam with bowing [N/m]; 0 of a linear spring
    bowing: np.ndarray  # (m, m) of entries and numbers: ``y^T S y / 2`` is its shortening

    @property
    def size(self) -> int:
        """Number of its coordinates."""
        return len(self.stiffness)

    def sample_sizes(self, length: float) -> list[float]:
        """A unit of motion of each coordinate."""
        return [1.0] * self.size

    @property
    def springs(self) -> list[Any]:
        """Stiffness of each coordinate, 0 along freedoms."""
        return self.stiffness


RecordedElement = RecordedJoint | RecordedSpring


def recorded_joint(freedom: PlacedFreedom, preload: float = 0.0) -> RecordedJoint:
    """A placed freedom as an element."""
    k = freedom.stiffness
    return RecordedJoint(
        np.array(freedom.point, dtype=object),
        np.array(freedom.axis, dtype=object),
        freedom.turns,
        freedom.advance(1),
        0 if k is None else k,
        preload,
    )


def recorded_springs(
    spring: PlacedSpring, like: FiniteSpring, parts: int, space: Space, length: float
) -> list[RecordedElement]:
    """An elastic part as one spring, or a beam as so many elements.

    `like` is the same part of one leg in numbers: whether it bows. `length` is that of the robot
    [m].
    """
    C = np.array(spring.elasticity.compliance, dtype=object)
    free = np.array(spring.elasticity.freedoms, dtype=object)
    rotation = np.array(spring.rotation, dtype=object)
    point = np.array(spring.point, dtype=object)
    bows, shifts = bool(np.any(like.axial)), [None]
    beam, axial = (2 * C[1, 5] / C[5, 5], parts / C[0, 0]) if bows else (0, 0)
    if bows:
        C = part_of_beam(C, beam, parts)
        x = rotation[:, 0] * beam
        shifts = [x * ((i + 1) / parts - 1) if i + 1 < parts else None for i in range(parts)]
    V, stiffness = _coordinates(C, free, rotation, space, length)
    S: np.ndarray = np.zeros((len(stiffness),) * 2, dtype=int).astype(object)
    if bows:
        inner = like.size > len(stiffness)
        planes = bending_planes(space, rotation)
        S, more = bowing(V, C, beam * (1 / parts), planes, inner=inner)
        V, stiffness = np.pad(V, ((0, 0), (0, len(more)))), [*stiffness, *more]
    return [
        RecordedSpring(point if shift is None else point + shift, rotation, V, stiffness, axial, S)
        for shift in shifts
    ]


def _coordinates(
    C: np.ndarray, free: np.ndarray, rotation: np.ndarray, space: Space, length: float
) -> tuple[np.ndarray, list[Any]]:
    """V (6, m) of an elastic part of a compliance and freedoms; stiffness of its columns."""
    own, C, free = among_motions(space, rotation, C, free)
    modes = _modes(C)
    columns = [own @ column for column in modes] + [own @ column for column in free.T]
    V, stiffness = [], []
    for i, column in enumerate(columns):
        sizes = [usual_size(x) / (length if k < 3 else 1.0) for k, x in enumerate(column)]
        size = max(*sizes, 1e-300)
        V.append(column * (1 / size))
        stiffness.append(1 / size**2 if i < len(modes) else 0)
    return np.array(V, dtype=object).T.reshape(6, len(V)), stiffness


def _modes(C: np.ndarray) -> list[np.ndarray]:
    """Twists F in columns with ``sum F F^T = C``; rotations come first, as in bending."""
    left, found = C.copy(), []
    for i in reversed(range(len(C))):
        pivot = left[i, i]
        if usual_size(pivot) <= _LOST**0.5 * usual_size(C[i, i]):
            continue
        column = left[:, i] * reciprocal(square_root(pivot))
        found.append(column)
        for a in range(i + 1):
            for b in range(i + 1):
                if is_zero(column[a]) or is_zero(column[b]):
                    continue
                rest = left[a, b] - column[a] * column[b]
                lost = usual_size(rest) ** 2 <= _LOST * usual_size(C[a, a]) * usual_size(C[b, b])
                left[a, b] = 0 if lost else rest
    return found
