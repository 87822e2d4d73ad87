"""Elements of a chain: joints and elastic parts that move far.

Each holds one element of several legs alike: a leading axis N counts the legs. How they move, and
the energy that they store, is computed for all elements of a chain together, in `moving_chain`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Placement:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where points (N, 3) of the body are now [m]."""
        return np.einsum("nij,nj->ni", self.R, point) + self.t


class Law(Protocol):
    """How the force of a joint follows from its motion."""

    def at(self, q: float) -> float:
        """Force [N or N m]."""
        ...

    def tangent(self, q: float) -> float:
        """Its derivative."""
        ...

    def energy(self, q: float) -> float:
        """Stored from rest [J]."""
        ...


@dataclass(frozen=True)
class FiniteJoint:
    """A joint that moves by q along its screw; energy ``k q^2 / 2 - f q``.

    Attributes
    ----------
    names : tuple of str
    point, axis : (N, 3) arrays
        In the world, at the unloaded posture [m].
    turns : bool
        Whether it turns by q about its axis.
    slide : (N,) array
        How far it slides along its axis for each unit of q: the pitch where it turns, otherwise 1.
    stiffness : (N,) array
        k of its drive or lock, 0 where it is passive [N/m or N m/rad].
    preload : (N,) array
        f, with which its drive pushes along its coordinate at q = 0 [N or N m].
    laws : tuple of Law or None
        In place of ``k q``, with k their tangent at rest; empty where there is none.
    """

    names: tuple[str, ...]
    point: np.ndarray
    axis: np.ndarray
    turns: bool
    slide: np.ndarray
    stiffness: np.ndarray
    preload: np.ndarray
    laws: tuple[Law | None, ...] = ()

    size = 1

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("joint", self.turns)

    @staticmethod
    def stacked(joints: Sequence[FiniteJoint]) -> FiniteJoint:
        """The same joint of several legs as one element."""
        return FiniteJoint(
            tuple(name for e in joints for name in e.names),
            np.concatenate([e.point for e in joints]),
            np.concatenate([e.axis for e in joints]),
            joints[0].turns,
            np.concatenate([e.slide for e in joints]),
            np.concatenate([e.stiffness for e in joints]),
            np.concatenate([e.preload for e in joints]),
            tuple(law for e in joints for law in (e.laws or (None,) * len(e.names)))
            if any(e.laws for e in joints)
            else (),
        )

    def under(self, laws: Sequence[Law | None]) -> FiniteJoint:
        """The joint of all legs, some of which follow laws of their own."""
        if not any(law is not None for law in laws):
            return self
        known = self.laws or (None,) * len(laws)
        laws = [old if new is None else new for new, old in zip(laws, known, strict=True)]
        rest = [
            k if law is None else law.tangent(0.0)
            for k, law in zip(self.stiffness, laws, strict=True)
        ]
        return replace(self, stiffness=np.array(rest, dtype=float), laws=tuple(laws))

    def force(self, i: int, q: float) -> float:
        """What it resists with in leg i, its preload left out [N or N m]."""
        law = self.laws[i] if self.laws else None
        return float(self.stiffness[i] * q) if law is None else law.at(q)

    def tangent(self, i: int, q: float) -> float:
        """Derivative of that force."""
        law = self.laws[i] if self.laws else None
        return float(self.stiffness[i]) if law is None else law.tangent(q)

    def energy(self, i: int, q: float) -> float:
        """Stored in leg i, work of its preload left out [J]."""
        law = self.laws[i] if self.laws else None
        return 0.5 * float(self.stiffness[i]) * q**2 if law is None else law.energy(q)

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of its coordinate turns or shifts (N, 1), shifts by the robot's length."""
        return np.full((len(self.point), 1), 1.0 if self.turns else 1.0 / length)

    @property
    def unloaded_curvature(self) -> np.ndarray:
        """Curvature of its energy at the unloaded posture (N, 1, 1)."""
        return self.stiffness[:, None, None]


@dataclass(frozen=True)
class BeamShape:
    """What axial load does to a beam between its ends.

    Attributes
    ----------
    axial : (N,) array
        EA/L [N/m].
    G : (N, 6, 6) array
        ``th^T G th`` is twice the shortening of the beam by bending [1/m, 1, m].
    """

    axial: np.ndarray
    G: np.ndarray


@dataclass(frozen=True)
class FiniteSpring:
    """An elastic part: its far end is displaced by d and turned by the rotation vector r.

    ``th = (d, r) = V y`` in its own axes; energy ``sum(k y^2) / 2`` with ``k`` 1, or 0 along
    freedoms, so that ``V V^T`` is its compliance; a beam has its bowing besides.

    Attributes
    ----------
    names : tuple of str
    point : (N, 3) array
        Its far end at the unloaded posture [m].
    rotation : (N, 3, 3) array
        Columns: its own axes.
    modes : (N, 6, m) array
        V.
    stiffness : (N, m) array
        k.
    bowing : BeamShape or None
    """

    names: tuple[str, ...]
    point: np.ndarray
    rotation: np.ndarray
    modes: np.ndarray
    stiffness: np.ndarray
    bowing: BeamShape | None = None

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return self.modes.shape[-1]

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return ("spring", self.size, self.bowing is None)

    @staticmethod
    def stacked(springs: Sequence[FiniteSpring]) -> FiniteSpring:
        """The same elastic part of several legs as one element."""
        shapes = [e.bowing for e in springs if e.bowing is not None]
        return FiniteSpring(
            tuple(name for e in springs for name in e.names),
            np.concatenate([e.point for e in springs]),
            np.concatenate([e.rotation for e in springs]),
            np.concatenate([e.modes for e in springs]),
            np.concatenate([e.stiffness for e in springs]),
            BeamShape(
                np.concatenate([shape.axial for shape in shapes]),
                np.concatenate([shape.G for shape in shapes]),
            )
            if shapes
            else None,
        )

    def sizes(self, length: float) -> np.ndarray:
        """What a unit of each coordinate turns or shifts (N, m), shifts by the robot's length."""
        V = np.abs(self.modes)
        return np.maximum(V[:, :3].max(1) / length, V[:, 3:].max(1))

    @property
    def unloaded_curvature(self) -> np.ndarray:
        """Curvature of its energy at the unloaded posture (N, m, m)."""
        return self.stiffness[:, :, None] * np.eye(self.size)


Element = FiniteJoint | FiniteSpring
