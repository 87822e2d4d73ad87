"""Springs between points of two bodies: what they pull, and how that changes as the points move.

With d from one point to the other, ``l = |d|`` and ``u = d / l``, a spring of stiffness k pulls
with ``t = k l + c``, of numbers or of entries. The force ``t u = k d + c u`` on the first point has
the derivative ``D = k I + (c/l)(I - u u^T) = k u u^T + (t/l)(I - u u^T)`` by d. It enters the
tangent of its leg as ``J^T D J``, J the velocity of d, and as a force does, with the second
derivatives of the points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.model import PlacedBodySpring
from robostiff.record import reciprocal, square_root, usual_size
from robostiff.statics.chains.elements import Spot

_IDENTITY = np.eye(3, dtype=int)
# Of the length of a spring at the unloaded posture, or of its tension: none.
_NONE = 1e-12


#: A place on the platform, before a chain without elements leads there.
ON_PLATFORM = Spot(-1, 0)
#: Bodies that hold the ends of a spring; None for the base.
Spots = tuple[Spot | None, Spot | None]


@dataclass(frozen=True)
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
    def placed(own: PlacedBodySpring, points: np.ndarray, spots: Spots) -> FiniteBodySpring:
        """A spring at one pose, of numbers or of entries.

        Raises
        ------
        InputError
            When its ends are in one point, and it pulls there: nowhere.
        """
        d = points[1] - points[0]
        length, constant = square_root(d @ d), own.tension - own.stiffness * own.length
        if abs(constant) <= _NONE * max(abs(own.tension), own.stiffness * own.length):
            constant = 0.0
        size = max(usual_size(x) for x in points.flat)
        rest = abs(constant) > _NONE * own.stiffness * size
        if usual_size(length) <= _NONE * size and rest:
            raise InputError(
                f"spring {own.name!r}",
                got="both ends in one point at the unloaded posture",
                expected="points apart: there the direction of its pull is not determined",
                hint="a spring of free length 0 alone may have no length",
            )
        known = own.stiffness, length, constant, own.is_cable
        return FiniteBodySpring(own.name, points, spots, *known)

    def renumbered(self, chains: Mapping[int, int]) -> FiniteBodySpring:
        """The same by other numbers of the chains."""
        a, b = (own and own._replace(chain=chains.get(own.chain, own.chain)) for own in self.spots)
        return replace(self, spots=(a, b))

    def energy(self, length: float, tension: float) -> float:
        """Stored from its free length; of a constant force, from the unloaded posture [J]."""
        if self.stiffness > 0:
            return 0.5 * tension**2 / self.stiffness
        return tension * (length - self.length)


@dataclass(frozen=True)
class SpringArrays:
    """Springs side by side: S of them, with two ends each, A of which chains hold."""

    points: np.ndarray  # (2, S, 3): of their ends, at the unloaded posture [m]
    on_base: np.ndarray  # (2, S): which ends the base has
    anchors: tuple[tuple[Spot, np.ndarray], ...]  # A of them: bodies, and points (3,) [m]
    of_spring: np.ndarray  # (A,)
    side: np.ndarray  # (A,): 0 and 1
    stiffness: np.ndarray  # (S,)
    length: np.ndarray
    constant: np.ndarray
    is_cable: np.ndarray

    @staticmethod
    def of(springs: Sequence[FiniteBodySpring]) -> SpringArrays:
        """Of some springs."""
        each = [(side, i, own.spots[side]) for side in (0, 1) for i, own in enumerate(springs)]
        held = [(side, i, spot) for side, i, spot in each if spot is not None]
        return SpringArrays(
            np.array([[own.points[side] for own in springs] for side in (0, 1)]),
            np.array([[own.spots[side] is None for own in springs] for side in (0, 1)]),
            tuple((spot, springs[i].points[side]) for side, i, spot in held),
            np.array([i for _, i, _ in held], dtype=int),
            np.array([side for side, *_ in held], dtype=int),
            np.array([own.stiffness for own in springs]),
            np.array([own.length for own in springs]),
            np.array([own.constant for own in springs]),
            np.array([own.is_cable for own in springs]),
        )

    def at(self, anchors: np.ndarray, rates: np.ndarray, share: float) -> Pulls:
        """What they do under a share of loads, where anchors are (A, 3) [m].

        `rates` (A, 3, T) are velocities of anchors by the unknowns of legs.
        """
        points, kind = self.points.copy(), self.points.dtype
        of_entries = kind == np.dtype(object)
        J = np.zeros((len(self.length), *rates.shape[1:]), dtype=int).astype(kind)
        points[self.side, self.of_spring] = anchors
        for i, side, rate in zip(self.of_spring, self.side, rates, strict=True):
            J[i] += rate * (2 * side - 1)
        d, k = points[1] - points[0], self.stiffness
        square = (d * d).sum(axis=-1)
        length = square_root(square) if of_entries else np.sqrt(square)
        steady = np.where(self.is_cable, 1, share)
        constant = steady * self.constant - (1 - steady) * k * self.length
        if of_entries:
            by = np.array([reciprocal(own) for own in length], dtype=object)
        else:
            slack = self.is_cable & (k * length + constant < 0)
            k, constant = np.where(slack, 0.0, k), np.where(slack, 0.0, constant)
            by = np.where(length > 0, 1 / np.where(length > 0, length, 1.0), 0.0)
        u, across = d * by[:, None], (constant * by)[:, None]
        stretched = k[:, None] + across  # t / l
        D = stretched[..., None] * _IDENTITY - (across * u)[:, :, None] * u[:, None]
        rate = np.where(self.is_cable, 0, self.constant + self.stiffness * self.length)
        tension = k * length + constant
        return Pulls(points, J, stretched * d, rate[:, None] * u, D, length, tension)

    def on_anchors(self, force: np.ndarray) -> np.ndarray:
        """Forces (A, 3) on the anchors, from those of springs (S, 3) on their first ends [N]."""
        return force[self.of_spring] * (1 - 2 * self.side)[:, None]


@dataclass(frozen=True)
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
