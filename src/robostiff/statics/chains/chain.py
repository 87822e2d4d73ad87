"""Chains of joints and elastic parts that move far, loads on their bodies, and states of legs.

Each holds elements of several legs alike: a leading axis N counts the legs. How they move, and the
energy that they store, is computed for all elements of a chain together, in `moving_chain`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from robostiff.errors import InputError
from robostiff.model import ForceLaw
from robostiff.model.stiffness_law import ForceFromStiffness
from robostiff.spatial import cross
from robostiff.statics.chains.bending import Bending, BowingTerms

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
    def kind(self) -> str:
        """``turn`` or ``slide``."""
        return "turn" if self.turns else "slide"

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (self.kind,)

    def under(self, law: Law) -> FiniteJoint:
        """The joint of one leg, following a law of its own."""
        return replace(self, stiffness=np.array([law.tangent(0.0)]), laws=(law,))

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
    A beam has its bowing besides, under an axial force that is an unknown of its own.
    """

    names: tuple[str, ...]
    point: np.ndarray  # (N, 3): its far end at the unloaded posture [m]
    rotation: np.ndarray  # (N, 3, 3): columns are its own axes
    modes: np.ndarray  # (N, 6, m): V
    stiffness: np.ndarray  # (N, m): k
    axial: np.ndarray  # (N,): EA/L of a beam with bowing [N/m]; 0 of a linear spring
    bending: Bending

    kind = "spring"

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
        V = np.abs(self.modes)
        return np.maximum(V[:, :3].max(1) / length, V[:, 3:].max(1))


Element = FiniteJoint | FiniteSpring
_Alike = TypeVar("_Alike", bound=Element | Bending)


def stacked(elements: Sequence[_Alike]) -> _Alike:
    """The same joint or elastic part of several legs as one element."""
    found = dict(vars(elements[0]))
    for name, value in found.items():
        if isinstance(value, np.ndarray):
            found[name] = np.concatenate([vars(e)[name] for e in elements])
        elif isinstance(value, tuple):
            found[name] = tuple(x for e in elements for x in vars(e)[name])
        elif isinstance(value, Bending):
            found[name] = stacked([vars(e)[name] for e in elements])
    return type(elements[0])(**found)


@dataclass(frozen=True)
class BodyLoad:
    """A force that keeps its direction, at a point of the body behind some elements of a chain."""

    after: int  # how many elements lie before the body
    point: np.ndarray  # (N, 3), or (3,) of entries: where it acts at the unloaded posture [m]
    force: np.ndarray  # alike, in the world [N]


class Owner(NamedTuple):
    """The leg of which a chain is part, and the place of the chain among all."""

    leg: int
    name: str
    order: int


class Spot(NamedTuple):
    """A body behind some elements of a chain, by the number of its group, its row, and its own."""

    group: int = 0
    row: int = 0
    chain: int = 0
    after: int = 0


#: Of chains to the platform on which springs are held.
NOBODY = Owner(-1, "", 0)


@dataclass(frozen=True)
class FiniteChain:
    """Elements in series from one body to another, of several legs alike."""

    start: int | None  # body at its start; None for the base
    end: int | None  # body at its end; None for the platform
    elements: tuple[Element, ...]
    loads: tuple[BodyLoad, ...] = ()
    # where springs between bodies are held, without a force of their own
    anchors: tuple[BodyLoad, ...] = ()
    owners: tuple[Owner, ...] = ()  # N of them

    @staticmethod
    def stacked(chains: Sequence[FiniteChain]) -> FiniteChain:
        """Chains whose elements are alike as one."""
        first = chains[0]
        elements = tuple(
            stacked([own.elements[k] for own in chains]) for k in range(len(first.elements))
        )
        loads = stacked_loads([own.loads for own in chains], [len(own.owners) for own in chains])
        owners = tuple(owner for own in chains for owner in own.owners)
        return FiniteChain(first.start, first.end, elements, loads, owners=owners)

    @cached_property
    def places(self) -> tuple[slice, ...]:
        """Coordinates of each element."""
        ends = np.cumsum([0] + [e.size for e in self.elements])
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.places[-1].stop if self.places else 0

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (self.start, self.end, *(e.signature for e in self.elements))


def stacked_loads(
    loads: Sequence[tuple[BodyLoad, ...]], counts: Sequence[int]
) -> tuple[BodyLoad, ...]:
    """Loads of several chains as those of one; a chain that has fewer carries zero forces.

    Each of the chains has so many legs.
    """
    found = []
    for after in sorted({load.after for own in loads for load in own}):
        there = [[load for load in own if load.after == after] for own in loads]
        for i in range(max(len(own) for own in there)):
            points, forces = [], []
            for own, count in zip(there, counts, strict=True):
                has = i < len(own)
                points.append(own[i].point if has else np.zeros((count, 3)))
                forces.append(own[i].force if has else np.zeros((count, 3)))
            found.append(BodyLoad(after, np.concatenate(points), np.concatenate(forces)))
    return tuple(found)


@dataclass(frozen=True)
class FiniteCoupling:
    """A gear or differential: a sum ``s = sum(a q)`` of joint coordinates, and what holds it."""

    drive: FiniteJoint  # the joint that follows, with the stiffness, preload and law against s
    is_rigid: bool  # whether s stays 0
    place: tuple[int, int]  # chain and element of the joint that follows
    terms: tuple[tuple[int, int], ...]  # the same of all joints that move
    factors: np.ndarray  # (N, k): a, of each leg

    @property
    def signature(self) -> tuple[object, ...]:
        """What must be alike in legs that are computed together."""
        return (self.is_rigid, self.place, self.terms)

    @staticmethod
    def stacked(couplings: Sequence[FiniteCoupling]) -> FiniteCoupling:
        """The same coupling of several legs."""
        drive = stacked([own.drive for own in couplings])
        return replace(
            couplings[0], drive=drive, factors=np.concatenate([own.factors for own in couplings])
        )

    def renumbered(self, chains: Mapping[int, int]) -> FiniteCoupling:
        """The same by other numbers of the chains."""
        first, *terms = ((chains[c], k) for c, k in (self.place, *self.terms))
        return replace(self, place=first, terms=tuple(terms))

    def pushed(self, preload: float) -> FiniteCoupling:
        """The same with more preload."""
        return replace(self, drive=replace(self.drive, preload=self.drive.preload + preload))


@dataclass(frozen=True)
class ChainTerms:
    """What chains contribute to the equations of their legs."""

    # (N, 3, 3) and (N, 3): where the body at the end is, as the chain has it, and its point [m]
    R: np.ndarray
    P: np.ndarray
    # (N, 6, n): velocity of the end point and angular velocity, by the unknowns that move the
    # chain: of the body at its start, where that moves, then its own
    J: np.ndarray
    # (N, n, n): curvature of the energy, less what wrench and loads do in second order, symmetric
    # part; what moments add to it, antisymmetric
    tangent: np.ndarray
    bracket: np.ndarray
    gradient: np.ndarray  # (N, n): of the energy, less the work of wrench and loads
    by_share: np.ndarray  # (N, n): derivative of the gradient by the share of loads and preloads
    turns: np.ndarray  # (N, S, 1): squares of the turns of elastic parts [rad^2]
    beams: BowingTerms  # of elastic parts (N, S)


@dataclass(frozen=True)
class MovingBody:
    """A rigid body of each leg: its axes (N, 3, 3), and where its own point is (N, 3) [m]."""

    R: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class LegState:
    """Coordinates of the legs of a group."""

    x: tuple[np.ndarray, ...]  # of each chain
    # what the body at the end of each chain exerts on it, about that body's point [N, N m]
    W: tuple[np.ndarray, ...]
    bodies: tuple[MovingBody, ...]  # between the chains of a leg
    held: np.ndarray  # (N, c): what rigid couplings push their sums with [N or N m]
    axial: np.ndarray  # (N, b): axial forces of beams with bowing [N]


@dataclass(frozen=True)
class LegEquations:
    """Residual and tangent of the legs of a group, platform apart."""

    A: np.ndarray  # (N, n, n): tangent by coordinates, bodies and wrenches
    r: np.ndarray  # (N, n): residual
    A_t: np.ndarray  # (N, n, r): derivative by the twist of the platform
    r_factor: np.ndarray  # (N, n): derivative by the factor of the loads
    state: LegState
    # (N, b), (N, b, c), (b, c): what axial forces of beams lack, how they follow coordinates, and
    # places of these among the unknowns
    axial: tuple[np.ndarray, np.ndarray, np.ndarray]

    def completed(self, found: np.ndarray) -> np.ndarray:
        """Steps (N, n, k) of the unknowns, those of axial forces behind; the first are Newton's."""
        missing, rate, places = self.axial
        axial = (rate[:, :, None] @ found[:, places])[:, :, 0]
        axial[..., 0] += missing
        return np.concatenate([found, axial], axis=1)


@dataclass(frozen=True)
class Share:
    """How much of preloads and of loads on legs acts, and how that grows with the factor."""

    value: float
    rate: float


def unknown_name(subject: str, name: object, known: Iterable[str], what: str) -> InputError:
    """An error that names what is alike to a name, or the first that there are."""
    known = list(known)
    near = get_close_matches(str(name), known, n=3) or known[:3]
    return InputError(subject, got=name, expected=f"{what}, such as {', '.join(map(repr, near))}")


def wrench_at(about: np.ndarray, point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Wrench (..., 6) about a point (3,) of forces (..., 3) at points (..., 3) [N, N m]."""
    return np.concatenate([force, cross(point - about, force)], axis=-1)
