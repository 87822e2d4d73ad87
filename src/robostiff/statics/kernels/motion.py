"""Elements of chains on recorded entries, and bodies that have moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.record import is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import elastic_element, in_series
from robostiff.statics.chains.chain import Element, FiniteJoint, FiniteSpring

# Of the product of two diagonal entries of a compliance: a square beside it that is rounding.
_LOST = 1e-20


def recorded_joint(freedom: PlacedFreedom, preload: float = 0.0) -> FiniteJoint:
    """A placed freedom on entries as an element; it pushes with the preload at q = 0 [N or N m]."""
    k = freedom.stiffness
    values = freedom.advance(1), 0 if k is None else k, preload, 0
    slide, stiffness, push, inertia = (np.array([x, None], dtype=object)[:1] for x in values)
    point, axis = (np.array([own], dtype=object) for own in (freedom.point, freedom.axis))
    name = (freedom.name,)
    return FiniteJoint(name, point, axis, freedom.turns, slide, stiffness, push, (None,), inertia)


def units(element: Element, length: float) -> list[float]:
    """A unit of motion of each coordinate: a radian, or the length of the robot [m].

    Coordinates of elastic parts on entries are of about this size themselves.
    """
    return [length if element.kind == "slide" else 1.0] * element.size


def recorded_springs(
    spring: PlacedSpring, like: FiniteSpring, parts: int, space: Space, length: float
) -> list[Element]:
    """An elastic part as one spring, or a beam as so many elements.

    `like` is the same part of one leg in numbers: whether it bows. `length` is that of the robot
    [m].
    """
    values = spring.rotation, spring.elasticity.compliance, spring.elasticity.freedoms
    rotation, C, free = (np.array(own, dtype=object) for own in values)

    def modes_of(C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        modes = _modes(C)
        V, stiffness = [], []
        for i, column in enumerate([*modes, *free.T]):
            shifts = np.arange(len(column)) < space.translations
            units = np.where(shifts, length, 1.0).tolist()
            sizes = [usual_size(x) / unit for x, unit in zip(column, units, strict=True)]
            size = max(*sizes, 1e-300)
            V.append(column * (1 / size))
            stiffness.append(1 / size**2 if i < len(modes) else 0)
        columns = np.array(V, dtype=object).T.reshape(len(C), len(V))
        return columns, np.array([*stiffness, None], dtype=object)[:-1]

    beam = 2 * C[1, 5] / C[5, 5] if np.any(like.axial) else None
    inner = bool(np.any(like.bending.b))
    own = elastic_element(space, rotation, (C, free), beam, parts, modes_of, inner=inner)
    return in_series(own, spring, 0 if beam is None else beam, parts)


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


def identity() -> np.ndarray:
    """Axes that have not turned."""
    return np.eye(3, dtype=int).astype(object)


@dataclass(frozen=True)
class Body:
    """A body that has moved: what was at X is at ``at + R (X - origin)``."""

    R: np.ndarray  # (3, 3) of entries and numbers
    # (3,) of entries and numbers: a point of it at the unloaded posture, and where it is [m]
    origin: np.ndarray
    at: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where a point of the unloaded posture is."""
        return self.at + self.R @ (point - self.origin)
