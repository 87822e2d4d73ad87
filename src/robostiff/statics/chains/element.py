"""Elements of a chain: joints and elastic parts that move far.

Each holds one element of several legs alike: a leading axis N counts the legs. How they move, and
the energy that they store, is computed for all elements of a chain together, in `moving_chain`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from robostiff.model import ForceLaw
from robostiff.model.stiffness_law import ForceFromStiffness

Law = ForceLaw | ForceFromStiffness


@dataclass(frozen=True)
class BodyPlace:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where points (..., 3) of the body are now [m]."""
        return (self.R @ point[..., None])[..., 0] + self.t


@dataclass(frozen=True)
class FiniteJoint:
    """A joint that moves by q along its screw; energy ``k q^2 / 2 - f q``."""

    names: tuple[str, ...]
    point: np.ndarray  # (N, 3): in the world, at the unloaded posture [m]
    axis: np.ndarray  # (N, 3)
    turns: bool  # by q about its axis
    slide: np.ndarray  # (N,): along its axis for each unit of q: its pitch where it turns, or 1
    stiffness: np.ndarray  # (N,): k of its drive or lock, 0 where it is passive [N/m or N m/rad]
    preload: np.ndarray  # (N,): f, with which its drive pushes at q = 0 [N or N m]
    laws: tuple[Law | None, ...]  # in place of k q, with k their tangent at rest
    inertia: np.ndarray  # (N,): of its drive in motion by q [kg or kg m^2]

    size = 1

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("joint", self.turns)

    def under(self, laws: Sequence[Law | None]) -> FiniteJoint:
        """The joint of all legs, some of which follow laws of their own."""
        laws = [old if new is None else new for new, old in zip(laws, self.laws, strict=True)]
        pairs = zip(self.stiffness, laws, strict=True)
        rest = [k if law is None else law.tangent(0.0) for k, law in pairs]
        return replace(self, stiffness=np.array(rest, dtype=float), laws=tuple(laws))

    def force(self, i: int, q: float) -> float:
        """What it resists with in leg i, its preload left out [N or N m]."""
        law = self.laws[i]
        return float(self.stiffness[i] * q) if law is None else law.at(q)

    def tangent(self, i: int, q: float) -> float:
        """Derivative of that force."""
        law = self.laws[i]
        return float(self.stiffness[i]) if law is None else law.tangent(q)

    def energy(self, i: int, q: float) -> float:
        """Stored in leg i, work of its preload left out [J]."""
        law = self.laws[i]
        return 0.5 * float(self.stiffness[i]) * q**2 if law is None else law.energy(q)

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of its coordinate turns or shifts (N, 1), shifts by the robot's length."""
        return np.full((len(self.point), 1), 1.0 if self.turns else 1.0 / length)


@dataclass(frozen=True)
class FiniteSpring:
    """An elastic part: its far end is displaced by d and turned by the rotation vector r.

    ``th = (d, r) = V y`` in its own axes; energy ``sum(k y^2) / 2``, with k zero along freedoms.
    The columns of V are zero for inner modes of a beam, which has its bowing besides.
    """

    names: tuple[str, ...]
    point: np.ndarray  # (N, 3): its far end at the unloaded posture [m]
    rotation: np.ndarray  # (N, 3, 3): columns are its own axes
    modes: np.ndarray  # (N, 6, m): V
    stiffness: np.ndarray  # (N, m): k
    axial: np.ndarray  # (N,): EA/L of a beam with bowing [N/m]; 0 of a linear spring
    bowing: np.ndarray  # (N, m, m): S; y^T S y is twice the shortening by bending [m]

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return self.modes.shape[-1]

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("spring", self.size, not np.any(self.axial))

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of each coordinate turns or shifts (N, m), shifts by the robot's length."""
        V, S = np.abs(self.modes), np.diagonal(self.bowing, axis1=1, axis2=2)
        # slopes of inner modes, or less
        inside = np.where(np.any(V, axis=1), 0.0, np.sqrt(S / length))
        return np.max([V[:, :3].max(1) / length, V[:, 3:].max(1), inside], axis=0)


Element = FiniteJoint | FiniteSpring
_Alike = TypeVar("_Alike", bound=Element)


def stacked(elements: Sequence[_Alike]) -> _Alike:
    """The same joint or elastic part of several legs as one element."""
    found = dict(vars(elements[0]))
    for name, value in found.items():
        if isinstance(value, np.ndarray):
            found[name] = np.concatenate([vars(e)[name] for e in elements])
        elif isinstance(value, tuple):
            found[name] = tuple(x for e in elements for x in vars(e)[name])
    return type(elements[0])(**found)
