"""Chains of joints and elastic parts that move far, and loads on their bodies.

How they move, and the energy that they store, is computed for all elements of a robot together, in
`moving_chain`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from robostiff.errors import InputError
from robostiff.model import ForceLaw
from robostiff.model.stiffness_law import ForceFromStiffness
from robostiff.record import is_zero
from robostiff.spatial import cross
from robostiff.statics.chains.bending import Bending

Law = ForceLaw | ForceFromStiffness


@dataclass(frozen=True)
class BodyPlace:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where a point (3,) of the body is now [m]."""
        return self.R @ point + self.t


@dataclass(frozen=True)
class FiniteJoint:
    """A joint that moves by q along its screw; energy ``k q^2 / 2 - f q``.

    Its values are numbers, or entries of a record.
    """

    name: str
    point: np.ndarray  # (3,): in the world, at the unloaded posture [m]
    axis: np.ndarray  # (3,)
    turns: bool  # by q about its axis
    slide: Any  # along its axis for each unit of q: its pitch where it turns, or 1
    stiffness: Any  # k of its drive or lock, 0 where it is passive [N/m or N m/rad]
    preload: Any = 0.0  # f, with which its drive pushes at q = 0 [N or N m]
    law: Law | None = None  # in place of k q, with k its tangent at rest
    inertia: float = 0.0  # of its drive in motion by q [kg or kg m^2]

    size = 1

    @property
    def kind(self) -> ElementKind:
        """What decides where its unknowns are."""
        return ElementKind(1, is_spring=False)

    def under(self, law: Law) -> FiniteJoint:
        """The joint following a law of its own."""
        return replace(self, stiffness=law.tangent(0.0), law=law)

    def force(self, q: Any) -> Any:
        """What it resists with, its preload left out [N or N m]."""
        return self.stiffness * q if self.law is None else self.law.at(float(q))

    def tangent(self, q: Any) -> Any:
        """Derivative of that force."""
        return self.stiffness if self.law is None else self.law.tangent(float(q))

    def energy(self, q: float) -> float:
        """Stored, work of its preload left out [J]."""
        return 0.5 * float(self.stiffness) * q**2 if self.law is None else self.law.energy(q)

    def sizes(self, length: float) -> list[float]:
        """What a unit of its coordinate turns or shifts, shifts by the robot's length."""
        return [1.0 if self.turns else 1.0 / length]


@dataclass(frozen=True)
class FiniteSpring:
    """An elastic part: its far end is displaced by d and turned by the rotation vector r.

    ``th = (d, r) = V y`` in its own axes; energy ``sum(k y^2) / 2``, with k zero along freedoms.
    A beam has its bowing besides, under an axial force that is an unknown of its own.
    """

    name: str
    point: np.ndarray  # (3,): its far end at the unloaded posture [m]
    rotation: np.ndarray  # (3, 3): columns are its own axes
    modes: np.ndarray  # (6, m): V
    stiffness: np.ndarray  # (m,): k
    axial: Any  # EA/L of a beam with bowing [N/m]; 0 of a linear spring
    bending: Bending

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return self.modes.shape[-1]

    @property
    def bows(self) -> bool:
        """Whether it is a beam with bowing."""
        return not is_zero(self.axial)

    @property
    def kind(self) -> ElementKind:
        """What decides where its unknowns are."""
        inner = (self.bending.b != 0).tobytes() if self.bows else None
        return ElementKind(self.size, is_spring=True, inner=inner)

    def sizes(self, length: float) -> list[float]:
        """What a unit of each coordinate turns or shifts (m,), shifts by the robot's length."""
        V = np.abs(self.modes)
        return np.maximum(V[:3].max(0) / length, V[3:].max(0)).tolist()


Element = FiniteJoint | FiniteSpring


@dataclass(frozen=True)
class BodyLoad:
    """A force that keeps its direction, at a point of the body behind some elements of a chain."""

    after: int  # how many elements lie before the body
    point: np.ndarray  # (3,): where it acts at the unloaded posture [m]
    force: np.ndarray  # (3,): in the world [N]


class ElementKind(NamedTuple):
    """What the numbers of unknowns take from an element."""

    size: int  # coordinates
    is_spring: bool
    inner: bytes | None = None  # of a beam with bowing: which inner modes it has


class ChainKind(NamedTuple):
    """The same of a chain."""

    start: int | None
    end: int | None
    elements: tuple[ElementKind, ...]
    loads: tuple[int, ...]  # of each: how many elements lie before its body


class Owner(NamedTuple):
    """The leg of which a chain is part, and the place of the chain among all."""

    leg: int
    name: str
    order: int


class Spot(NamedTuple):
    """A body behind some elements of a chain, by the number of the chain and theirs."""

    chain: int
    after: int


#: Of chains to the platform on which springs are held.
NOBODY = Owner(-1, "", 0)


@dataclass(frozen=True)
class FiniteChain:
    """Elements in series from one body to another."""

    start: int | None  # body at its start; None for the base
    end: int | None  # body at its end; None for the platform
    elements: tuple[Element, ...]
    loads: tuple[BodyLoad, ...] = ()
    owner: Owner = NOBODY

    @property
    def kind(self) -> ChainKind:
        """What decides where its unknowns are."""
        elements, loads = tuple(e.kind for e in self.elements), tuple(b.after for b in self.loads)
        return ChainKind(self.start, self.end, elements, loads)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(e.size for e in self.elements)


@dataclass(frozen=True)
class FiniteCoupling:
    """A gear or differential: a sum ``s = sum(a q)`` of joint coordinates, and what holds it."""

    drive: FiniteJoint  # the joint that follows, with the stiffness, preload and law against s
    is_rigid: bool  # whether s stays 0
    place: tuple[int, int]  # chain and element of the joint that follows
    terms: tuple[tuple[int, int], ...]  # the same of all joints that move
    factors: np.ndarray  # (k,): a

    def renumbered(self, chains: Mapping[int, int]) -> FiniteCoupling:
        """The same by other numbers of the chains."""
        first, *terms = ((chains[c], k) for c, k in (self.place, *self.terms))
        return replace(self, place=first, terms=tuple(terms))


@dataclass(frozen=True)
class Share:
    """How much of preloads and of loads on legs acts, and how that grows with the factor."""

    value: float
    rate: float


def unknown_name(subject: str, name: object, known: Iterable[str], what: str) -> InputError:
    """An error that names what is alike to a name, or the first that there are."""
    known = list(known)
    near = ", ".join(map(repr, get_close_matches(str(name), known, n=3) or known[:3]))
    alone = what.removeprefix("a ").removeprefix("an ")
    expected = f"{what}, such as {near}" if known else f"none: there is no {alone}"
    return InputError(subject, got=name, expected=expected)


def wrench_at(about: np.ndarray, point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Wrench (..., 6) about a point (3,) of forces (..., 3) at points (..., 3) [N, N m]."""
    return np.concatenate([force, cross(point - about, force)], axis=-1)
