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
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.errors import InputError
from robostiff.model import PlacedBodySpring
from robostiff.record import reciprocal, square_root, usual_size
from robostiff.statics.chains.chain import BodyLoad, LegState

if TYPE_CHECKING:
    from robostiff.statics.chains.legs import LegGroup
    from robostiff.statics.equations.problem import EquilibriumProblem, State

_IDENTITY = np.eye(3, dtype=int)
# Of the length of a spring at the unloaded posture, or of its tension: none.
_NONE = 1e-12


#: Number of the chain that leads to the platform, before it has one.
TO_PLATFORM = -1


@dataclass(frozen=True)
class Anchor:
    """A point of a body that holds an end of a spring, at the unloaded posture [m].

    It is one of the anchors of a chain; without a chain on the base. Chains without elements lead
    to the platform where springs are held on it.
    """

    point: np.ndarray
    chain: int | None = None
    place: int = 0


@dataclass(frozen=True)
class FiniteBodySpring:
    """A spring between two bodies; ``t = k l + s c - (1 - s) k l_0`` at the share s of loads.

    So it is relaxed at the unloaded posture without loads. A cable has its tension there at any
    share, and none where that would push.
    """

    name: str
    ends: tuple[Anchor, Anchor]
    stiffness: float  # k [N/m]
    length: Any  # l_0, at the unloaded posture [m], a number or an entry
    constant: float  # c [N]
    is_cable: bool = False

    @staticmethod
    def placed(own: PlacedBodySpring, ends: tuple[Anchor, Anchor]) -> FiniteBodySpring:
        """A spring at one pose, of numbers or of entries.

        Raises
        ------
        InputError
            When its ends are in one point, and it pulls there: nowhere.
        """
        d = ends[1].point - ends[0].point
        length, constant = square_root(d @ d), own.tension - own.stiffness * own.length
        if abs(constant) <= _NONE * max(abs(own.tension), own.stiffness * own.length):
            constant = 0.0
        size = max(usual_size(x) for end in ends for x in end.point)
        rest = abs(constant) > _NONE * own.stiffness * size
        if usual_size(length) <= _NONE * size and rest:
            raise InputError(
                f"spring {own.name!r}",
                got="both ends in one point at the unloaded posture",
                expected="points apart: there the direction of its pull is not determined",
                hint="a spring of free length 0 alone may have no length",
            )
        return FiniteBodySpring(own.name, ends, own.stiffness, length, constant)

    def renumbered(self, chains: Mapping[int, int]) -> FiniteBodySpring:
        """The same by other numbers of the chains."""
        a, b = (
            end if end.chain is None else replace(end, chain=chains.get(end.chain, end.chain))
            for end in self.ends
        )
        return replace(self, ends=(a, b))

    def energy(self, length: float, tension: float) -> float:
        """Stored from its free length; of a constant force, from the unloaded posture [J]."""
        if self.stiffness > 0:
            return 0.5 * tension**2 / self.stiffness
        return tension * (length - self.length)


def held_on_platform(
    springs: Sequence[FiniteBodySpring], chain: int
) -> tuple[list[FiniteBodySpring], tuple[BodyLoad, ...]]:
    """Springs with their ends on the platform held by a chain without elements; its anchors."""
    found, anchors = [], []
    for own in springs:
        ends = []
        for end in own.ends:
            if end.chain == TO_PLATFORM:
                ends.append(replace(end, chain=chain, place=len(anchors)))
                anchors.append(BodyLoad(0, end.point[None], 0 * end.point[None]))
            else:
                ends.append(end)
        found.append(replace(own, ends=(ends[0], ends[1])))
    return found, tuple(anchors)


@dataclass(frozen=True)
class SpringArrays:
    """The springs of a group side by side: S of them, with two ends each."""

    points: np.ndarray  # (2, S, 3): of their ends, at the unloaded posture [m]
    on_base: np.ndarray  # (2, S): which ends the base has
    on_chains: tuple[tuple[int, int, int, int], ...]  # end, spring, chain, and place there
    stiffness: np.ndarray  # (S,)
    length: np.ndarray
    constant: np.ndarray
    is_cable: np.ndarray

    @staticmethod
    def of(springs: Sequence[FiniteBodySpring]) -> SpringArrays:
        """Of some springs."""
        ends = [[own.ends[side] for own in springs] for side in (0, 1)]
        return SpringArrays(
            np.array([[end.point for end in own] for own in ends]),
            np.array([[end.chain is None for end in own] for own in ends]),
            tuple(
                (side, i, end.chain, end.place)
                for side, own in enumerate(ends)
                for i, end in enumerate(own)
                if end.chain is not None
            ),
            np.array([own.stiffness for own in springs]),
            np.array([own.length for own in springs]),
            np.array([own.constant for own in springs]),
            np.array([own.is_cable for own in springs]),
        )

    def at(self, group: LegGroup, state: LegState, share: float) -> Pulls:
        """Where they are, and what they do, at a state of legs under a share of loads."""
        points, kind = self.points.copy(), self.points.dtype
        of_entries = kind == np.dtype(object)
        J = np.zeros((len(self.length), 3, group.free_size), dtype=int).astype(kind)
        anchored = group.anchored(state)
        for side, i, chain, place in self.on_chains:
            points[side, i] = anchored[chain][0][place]
            J[i] += anchored[chain][1][place] * (1 if side else -1)
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


@dataclass(frozen=True)
class Pulls:
    """What springs do at a state: forces (S, 3) on first points; the opposite on the second [N].

    `rate` is that of the force by the share of loads, D that by the vector between the points
    [N/m]; J is that of this vector.
    """

    points: np.ndarray  # (2, S, 3): of their ends [m]
    J: np.ndarray  # (S, 3, m): by the free unknowns of legs
    force: np.ndarray
    rate: np.ndarray
    D: np.ndarray  # (S, 3, 3)
    length: np.ndarray
    tension: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """``J^T D J`` (m, m)."""
        m = self.J.shape[-1]
        return self.J.reshape(-1, m).T @ (self.D @ self.J).reshape(-1, m)

    @property
    def by_share(self) -> np.ndarray:
        """Derivative of the gradient of the energy by the share of loads (m,)."""
        return self.J.reshape(-1, self.J.shape[-1]).T @ self.rate.ravel()


def on_anchors(group: LegGroup, force: np.ndarray) -> list[np.ndarray]:
    """Forces (A, 3) on the anchors of each chain, from those of springs (S, 3) [N]."""
    none = [np.zeros((len(own.anchors), 3), dtype=int) for own in group.chains]
    found = [own.astype(force.dtype) for own in none]
    for side, i, chain, place in group.spring_arrays.on_chains:
        found[chain][place] += force[i] * (1 if side == 0 else -1)
    return found


def small_forces(group: LegGroup, step: np.ndarray) -> np.ndarray:
    """Forces of springs (S, 3) on their first points under small loads, tension among them.

    The coordinates and bodies of the legs move by a step (m,).
    """
    own = group.spring_arrays.at(group, group.unloaded(), 0.0)
    return (own.D @ (own.J @ step)[..., None])[..., 0] + own.rate


@dataclass(frozen=True)
class LoadedSpring:
    """A spring between two bodies under load.

    Attributes
    ----------
    name : str
    points : (2, 3) array
        Where its ends are [m].
    length : float
        [m].
    tension : float
        Negative where it pushes [N].
    energy : float
        Stored [J]: from its free length; of a constant force, from the unloaded posture.
    is_cable : bool
        Whether it only pulls.
    """

    name: str
    points: np.ndarray
    length: float
    tension: float
    energy: float
    is_cable: bool = False


def loaded_springs(
    problem: EquilibriumProblem, state: State, share: float
) -> tuple[LoadedSpring, ...]:
    """Every spring between bodies at a state of a robot."""
    found = []
    for group, own in zip(problem.groups, state.legs, strict=True):
        if not group.springs:
            continue
        now = group.spring_arrays.at(group, own, share)
        for i, spring in enumerate(group.springs):
            length, tension = float(now.length[i]), float(now.tension[i])
            ends, energy = now.points[:, i], spring.energy(length, tension)
            found.append(LoadedSpring(spring.name, ends, length, tension, energy, spring.is_cable))
    return tuple(found)
