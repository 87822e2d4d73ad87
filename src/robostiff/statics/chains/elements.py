"""Elements of chains that move far, loads on their bodies, and springs between bodies.

How chains move, and the energy that they store, is computed for all elements of a robot together,
in `moving_chain`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.model import ForceLaw, PlacedBodySpring
from robostiff.model.stiffness_law import ForceFromStiffness
from robostiff.record import is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import cross

Law = ForceLaw | ForceFromStiffness
# Part of the critical load of an inner mode, from which the axial force keeps away.
_NEAREST = 1e-9
_IDENTITY = np.eye(3, dtype=int)
# Of the length of a spring at the unloaded posture, or of its tension: none.
_NONE = 1e-12


@frozen
class BodyPlace:
    """A body that has moved: a point X of the unloaded posture is now at ``R X + t``."""

    R: np.ndarray
    t: np.ndarray

    def of(self, point: np.ndarray) -> np.ndarray:
        """Where a point (3,) of the body is now [m]."""
        return self.R @ point + self.t


@frozen
class FiniteJoint:
    """A joint that moves by q along its screw; energy ``k q^2 / 2 - f q``.

    Its values are numbers, or entries of a record. Elements, and what they carry, may be at many
    poses: arrays have an entry a pose then, along their first axis.
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
    is_passed_back: bool = False  # by its chain, from its second body to its first

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


@frozen
class Bending:
    """How bending shortens beams, by forms z of the motion of the far end that do not mix.

    Under the axial force N the energy of a beam is, beside that of its linear springs, ``sum(h(N)
    z^2) / 2 - (N - k u)^2 / (2 k)``, stationary in N, with ``h = N s - N^2 b / (1 + N l)``, u the
    stretch of the ends and k = EA/L. The forms shorten the line by ``s z^2 / 2``. b and l are those
    of an inner mode, in balance with z: where ``1 + N l`` is zero, it buckles between clamped ends.
    """

    z: np.ndarray  #: (..., F, m): F forms by the coordinates of the beam
    s: np.ndarray  #: (..., F): [1/m] of shifts, [m] of turns
    #: b, l (..., F): [1/N] of shifts, [m^2/N] of turns; [1/N]. Zero where there is no inner mode.
    b: np.ndarray
    l: np.ndarray

    def terms(self, y: np.ndarray, N: np.ndarray, along: np.ndarray, k: np.ndarray) -> BowingTerms:
        """The energy beside that of linear springs, and what it contributes to equations.

        N is eliminated: with ``q = dz/dy h'(N) z + du/dy`` and ``D = 1/k - sum(h''(N) z^2) / 2``,
        what is stationary in y has the curvature ``sum(h dz/dy dz/dy^T) - k du/dy du/dy^T + q q^T /
        D``, and N follows the coordinates by ``q / D``.

        Parameters
        ----------
        y : (..., m) array
            Coordinates, of numbers or of entries, as all others.
        N, k : (...) arrays
            Axial force, and EA/L; 1 where there is no beam [N, N/m].
        along : (..., m) array
            u by the coordinates.
        """
        z, N_ = (self.z @ y[..., None])[..., 0], N[..., None]
        pivots = self.pivots(N)
        g = 1 / pivots
        h = N_ * self.s - N_ * N_ * self.b * g
        slope = self.s - N_ * self.b * g * (1 + g)
        bend = self.b * g * g * g * 2
        beyond = N - k * (along * y).sum(axis=-1)
        q = along + _times(slope * z, self.z)
        softness = 1 / k + (bend * z * z).sum(axis=-1) * 0.5
        missing = ((slope * z * z).sum(axis=-1) * 0.5 - beyond / k) / softness
        rate = q / softness[..., None]
        return BowingTerms(
            (h * z * z).sum(axis=-1) * 0.5 - beyond * beyond / k * 0.5,
            along * beyond[..., None] + _times(h * z, self.z) + q * missing[..., None],
            np.swapaxes(self.z, -1, -2) @ (self.z * h[..., None])
            - _outer(along * k[..., None], along)
            + _outer(q, rate),
            missing,
            rate,
            pivots,
        )

    def pivots(self, N: np.ndarray) -> np.ndarray:
        """``1 + N l`` (..., F); in numbers, no nearer to zero than digits allow."""
        found = 1 + N[..., None] * self.l
        if found.dtype == object:
            return found
        return np.where(np.abs(found) < _NEAREST, np.copysign(_NEAREST, found), found)

    def with_modes(
        self, y: np.ndarray, N: np.ndarray, along: np.ndarray, k: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Curvature of the energy by coordinates and amplitudes, none of these eliminated.

        By the former (..., m, m), by both (..., F, m), by the latter (..., F, F), that of the modes
        themselves among it; in numbers.
        """
        z, N_, k_ = (self.z @ y[..., None])[..., 0], N[..., None, None], k[..., None, None]
        root, identity = np.sqrt(self.b), np.eye(self.l.shape[-1])
        a = -N[..., None] * root * z / self.pivots(N)  # each of which stores a^2 / 2
        of_y = along + _times(self.s * z + root * a, self.z)
        of_a = root * z + self.l * a
        S = np.swapaxes(self.z, -1, -2) @ (self.z * self.s[..., None])
        return (
            _outer(of_y, of_y) * k_ - _outer(along, along) * k_ + N_ * S,
            _outer(of_a, of_y) * k_ + N_ * (root[..., None] * self.z),
            _outer(of_a, of_a) * k_ + (1 + N_ * self.l[..., None]) * identity,
        )


@frozen
class BowingTerms:
    """What bowing contributes to the equations of beams with m coordinates; see `Bending`."""

    energy: np.ndarray  # (...)
    # (..., m) and (..., m, m): of the energy, the axial force eliminated
    gradient: np.ndarray
    curvature: np.ndarray
    # (...) and (..., m): what the axial force lacks, and how it follows the coordinates
    missing: np.ndarray
    rate: np.ndarray
    pivots: np.ndarray  # (..., F): 1 + N l; positive where inner modes are stable


def _times(v: np.ndarray, M: np.ndarray) -> np.ndarray:
    """``v M`` of vectors (..., i) and matrices (..., i, j)."""
    return (v[..., None, :] @ M)[..., 0, :]


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., :, None] * b[..., None, :]


@frozen
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
    ends: float = 1.0  # part of the length of its elastic part that is before its end
    goes_on: bool = False  # results have it together with the element behind it

    @property
    def size(self) -> int:
        """Number of coordinates m."""
        return self.modes.shape[-1]

    @property
    def bows(self) -> bool:
        """Whether it is a beam with bowing."""
        return isinstance(self.axial, np.ndarray) or not is_zero(self.axial)

    @cached_property
    def kind(self) -> ElementKind:
        """What decides where its unknowns are."""
        b = self.bending.b  # alike at all poses
        inner = ((b if b.ndim == 1 else b[0]) != 0).tobytes() if self.bows else None
        return ElementKind(self.size, is_spring=True, inner=inner)


Element = FiniteJoint | FiniteSpring


@frozen
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

    def behind(self, bodies: int) -> ChainKind:
        """The same behind so many bodies of other robots."""
        start, end = (None if b is None else b + bodies for b in self[:2])
        return self._replace(start=start, end=end)


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


@frozen
class FiniteChain:
    """Elements in series from one body to another."""

    start: int | None  # body at its start; None for the base
    end: int | None  # body at its end; None for the platform
    elements: tuple[Element, ...]
    loads: tuple[BodyLoad, ...] = ()
    owner: Owner = NOBODY

    @cached_property
    def kind(self) -> ChainKind:
        """What decides where its unknowns are."""
        elements, loads = tuple(e.kind for e in self.elements), tuple(b.after for b in self.loads)
        return ChainKind(self.start, self.end, elements, loads)


@frozen
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


def group_of(is_cable: bool) -> str:
    """What stands for a leg where springs between bodies, or cables, are named."""
    return "cables" if is_cable else "springs"


def wrench_at(about: np.ndarray, point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Wrench (..., 6) about a point (3,) of forces (..., 3) at points (..., 3) [N, N m]."""
    return np.concatenate([force, cross(point - about, force)], axis=-1)


#: A place on the platform, before a chain without elements leads there.
ON_PLATFORM = Spot(-1, 0)
#: Bodies that hold the ends of a spring; None for the base.
Spots = tuple[Spot | None, Spot | None]
#: An end of a spring that a chain holds: which, of which of all springs, and the body.
Anchor = tuple[int, int, Spot]


@frozen
class FiniteBodySpring:
    """A spring between two bodies; ``t = k l + s c - (1 - s) k l_0`` at the share s of loads.

    So it is relaxed at the unloaded posture without loads. A cable has its tension there at any
    share, and none where that would push.
    """

    name: str
    points: np.ndarray  # (2, 3): of its ends, at the unloaded posture [m]
    spots: Spots
    stiffness: float  # k [N/m]
    length: Any  # l_0, at the unloaded posture [m], a number or an entry
    constant: float  # c [N]
    is_cable: bool = False

    @staticmethod
    def placed(spring: PlacedBodySpring, points: np.ndarray, spots: Spots) -> FiniteBodySpring:
        """A spring at one pose, of numbers or of entries.

        Raises
        ------
        InputError
            When its ends are in one point, and it pulls there: nowhere.
        """
        d = points[1] - points[0]
        length, constant = square_root(d @ d), spring.tension - spring.stiffness * spring.length
        if abs(constant) <= _NONE * max(abs(spring.tension), spring.stiffness * spring.length):
            constant = 0.0
        size = max(usual_size(x) for x in points.flat)
        rest = abs(constant) > _NONE * spring.stiffness * size
        if usual_size(length) <= _NONE * size and rest:
            raise InputError(
                f"spring {spring.name!r}",
                got=Words("both ends in one point at the unloaded posture"),
                expected="points apart: there the direction of its pull is not determined",
                hint="a spring of free length 0 alone may have no length",
            )
        known = spring.stiffness, length, constant, spring.is_cable
        return FiniteBodySpring(spring.name, points, spots, *known)

    def renumbered(self, chains: Mapping[int, int]) -> FiniteBodySpring:
        """The same by other numbers of the chains."""
        a, b = (s and s._replace(chain=chains.get(s.chain, s.chain)) for s in self.spots)
        return replace(self, spots=(a, b))

    def energy(self, length: float, tension: float) -> float:
        """Stored from its free length; of a constant force, from the unloaded posture [J]."""
        if self.stiffness > 0:
            return 0.5 * tension**2 / self.stiffness
        return tension * (length - self.length)


@frozen
class Pulls:
    """What springs do at a state: forces (S, 3) on first points; the opposite on the second [N].

    `rate` is that of the force by the share of loads, D that by the vector between the points
    [N/m]; J is that of this vector.
    """

    points: np.ndarray  # (2, S, 3): of their ends [m]
    J: np.ndarray  # (S, 3, T): by the unknowns of legs
    force: np.ndarray
    rate: np.ndarray
    D: np.ndarray  # (S, 3, 3)
    length: np.ndarray
    tension: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """``J^T D J`` (T, T)."""
        m = self.J.shape[-1]
        return self.J.reshape(-1, m).T @ (self.D @ self.J).reshape(-1, m)

    @property
    def by_share(self) -> np.ndarray:
        """Derivative of the gradient of the energy by the share of loads (T,)."""
        return self.J.reshape(-1, self.J.shape[-1]).T @ self.rate.ravel()


def pulls_of(
    springs: Sequence[FiniteBodySpring],
    anchors: Sequence[Anchor],
    at: np.ndarray,
    rates: np.ndarray,
    share: float,
) -> Pulls:
    """What S springs do under a share of loads, where their anchors are (A, 3) [m].

    `rates` (A, 3, T) are velocities of anchors by the unknowns of legs.
    """
    k, rest, pull, is_cable = (
        np.array([getattr(spring, name) for spring in springs])
        for name in ("stiffness", "length", "constant", "is_cable")
    )
    points = np.stack([spring.points for spring in springs], axis=1)
    J = np.zeros((len(springs), *rates.shape[1:]), dtype=int).astype(points.dtype)
    for (side, i, _), point, rate in zip(anchors, at, rates, strict=True):
        points[side, i] = point
        J[i] += rate * (2 * side - 1)
    d = points[1] - points[0]
    length = square_root((d * d).sum(axis=-1))
    steady, rate = np.where(is_cable, 1, share), np.where(is_cable, 0, pull + k * rest)
    constant = steady * pull - (1 - steady) * k * rest
    if points.dtype == object:
        by = np.array([reciprocal(x) for x in length], dtype=object)
    else:
        slack = is_cable & (k * length + constant < 0)
        k, constant = np.where(slack, 0.0, k), np.where(slack, 0.0, constant)
        by = np.where(length > 0, 1 / np.where(length > 0, length, 1.0), 0.0)
    u, across = d * by[:, None], (constant * by)[:, None]
    stretched = k[:, None] + across  # t / l
    D = stretched[..., None] * _IDENTITY - (across * u)[:, :, None] * u[:, None]
    tension = k * length + constant
    return Pulls(points, J, stretched * d, rate[:, None] * u, D, length, tension)
