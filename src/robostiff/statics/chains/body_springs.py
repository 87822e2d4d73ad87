"""Springs between points of two bodies: what they pull, and how that changes as the points move.

With d from one point to the other, ``l = |d|`` and ``u = d / l``, a spring of stiffness k pulls
with ``t = k l + c``. The force ``t u = k d + c u`` on the first point has the derivative
``D = k I + (c/l)(I - u u^T) = k u u^T + (t/l)(I - u u^T)`` by d. It enters the tangent of its leg
as ``J^T D J``, J the velocity of d, and as a force does, with the second derivatives of the points.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robostiff.errors import InputError
from robostiff.model import PlacedBodySpring, Snapshot
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.statics.chains.chain import Beside, LegState, Share, unknown_name
from robostiff.statics.chains.finite_turn import crossed, skews

if TYPE_CHECKING:
    from robostiff.statics.chains.legs import LegGroup
    from robostiff.statics.equations.problem import EquilibriumProblem, State

_IDENTITY = np.eye(3)
# Of the length of a spring at the unloaded posture, or of its tension: none.
_NONE = 1e-12


@dataclass(frozen=True)
class Anchor:
    """A point of a body that holds an end of a spring, at the unloaded posture [m].

    It is one of the anchors of a chain; without a chain on the base, or on the platform.
    """

    point: np.ndarray
    chain: int | None = None
    place: int = 0
    on_platform: bool = False


@dataclass(frozen=True)
class FiniteBodySpring:
    """A spring between two bodies; ``t = s tension + stiffness (l - length)`` at the share s.

    A cable has its tension at any share, and none where that would push.

    Raises
    ------
    InputError
        When its ends are in one point, and it pulls there: nowhere.
    """

    name: str
    ends: tuple[Anchor, Anchor]
    stiffness: float  # [N/m]
    # at the unloaded posture [m], [N]
    length: float
    tension: float
    is_cable: bool = False

    def __post_init__(self) -> None:
        constant = abs(self.tension - self.stiffness * self.length)
        size = max(float(np.max(np.abs(end.point), initial=0.0)) for end in self.ends)
        if self.length <= _NONE * size and constant > _NONE * self.stiffness * size:
            raise InputError(
                f"spring {self.name!r}",
                got="both ends in one point at the unloaded posture",
                expected="points apart: there the direction of its pull is not determined",
                hint="a spring of free length 0 alone may have no length",
            )

    def energy(self, length: float, tension: float) -> float:
        """Stored from its free length; of a constant force, from the unloaded posture [J]."""
        if self.stiffness > 0:
            return 0.5 * tension**2 / self.stiffness
        return tension * (length - self.length)


@dataclass(frozen=True)
class SpringArrays:
    """The springs of a group side by side: S of them, with two ends each."""

    points: np.ndarray  # (2, S, 3): of their ends, at the unloaded posture [m]
    on_platform: np.ndarray  # (2, S): which ends the platform has
    on_base: np.ndarray  # (2, S): which ends the base has
    on_chains: tuple[tuple[int, int, int, int], ...]  # end, spring, chain, and place there
    stiffness: np.ndarray  # (S,)
    length: np.ndarray
    tension: np.ndarray
    is_cable: np.ndarray

    @staticmethod
    def of(springs: Sequence[FiniteBodySpring]) -> SpringArrays:
        """Of some springs."""
        ends = [[own.ends[side] for own in springs] for side in (0, 1)]
        return SpringArrays(
            np.array([[end.point for end in own] for own in ends]),
            np.array([[end.on_platform for end in own] for own in ends]),
            np.array([[end.chain is None and not end.on_platform for end in o] for o in ends]),
            tuple(
                (side, i, end.chain, end.place)
                for side, own in enumerate(ends)
                for i, end in enumerate(own)
                if end.chain is not None
            ),
            np.array([own.stiffness for own in springs]),
            np.array([own.length for own in springs]),
            np.array([own.tension for own in springs]),
            np.array([own.is_cable for own in springs]),
        )

    def at(
        self, group: LegGroup, state: LegState, R: np.ndarray, p: np.ndarray, share: float
    ) -> Pulls:
        """Where they are, and what they do, at a state of legs, with the platform at (R, p)."""
        points, count = self.points.copy(), len(self.length)
        J, J_t = np.zeros((count, 3, group.free_size)), np.zeros((count, 3, 6))
        arms = np.where(
            self.on_platform[..., None], (self.points - group.platform_point) @ R.T, 0.0
        )
        points[self.on_platform] = p + arms[self.on_platform]
        sign = np.array([-1.0, 1.0])[:, None]
        J_t[:, :, :3] = np.sum(sign * self.on_platform, axis=0)[:, None, None] * np.eye(3)
        J_t[:, :, 3:] = -skews(arms[1] - arms[0])
        if self.on_chains:
            anchored = group.anchored(state)
            for side, i, chain, place in self.on_chains:
                points[side, i] = anchored[chain][0][place]
                J[i] += sign[side] * anchored[chain][1][place]
        d = points[1] - points[0]
        length, k = np.sqrt(np.sum(d * d, axis=-1)), self.stiffness
        apart, steady = length > 0, np.where(self.is_cable, 1.0, share)
        constant = steady * self.tension - k * self.length
        tension = k * length + constant
        safe = np.where(apart, length, 1.0)
        u, across = d / safe[:, None], np.where(apart, constant / safe, 0.0)
        slack = self.is_cable & (tension < 0)
        tension, k = np.where(slack, 0.0, tension), np.where(slack, 0.0, k)
        across = np.where(slack, 0.0, across)[:, None, None]
        D = k[:, None, None] * _IDENTITY + across * (_IDENTITY - u[:, :, None] * u[:, None])
        rate = np.where(self.is_cable, 0.0, self.tension)[:, None] * u
        return Pulls(points, arms, J, J_t, tension[:, None] * u, rate, D, length, tension)


@dataclass(frozen=True)
class Pulls:
    """What springs do at a state: forces (S, 3) on first points; the opposite on the second [N].

    `rate` is that of the force by the share of loads, D that by the vector between the points
    [N/m]; J and J_t are those of this vector.
    """

    points: np.ndarray  # (2, S, 3): of their ends [m]
    arms: np.ndarray  # (2, S, 3): to ends on the platform from its point [m]; 0 elsewhere
    J: np.ndarray  # (S, 3, m): by the free unknowns of legs
    J_t: np.ndarray  # (S, 3, 6): by the twist of the platform

    force: np.ndarray
    rate: np.ndarray
    D: np.ndarray  # (S, 3, 3)
    length: np.ndarray
    tension: np.ndarray


@dataclass(frozen=True)
class SpringTerms:
    """What springs between bodies contribute to the equations of their legs, m free unknowns."""

    pulls: Sequence[np.ndarray]  # forces on the anchors of each chain [N]
    stiffness: np.ndarray  # (m, m): ``J^T D J``
    by_share: np.ndarray  # (m,): derivative of the gradient of the energy by the share of loads
    by_twist: np.ndarray  # (m, r): the same by the twist of the platform
    carried: np.ndarray  # (r,): what the platform exerts on springs about its point [N, N m]
    beside: Beside  # its derivatives

    @staticmethod
    def of(
        group: LegGroup, state: LegState, R: np.ndarray, p: np.ndarray, share: Share
    ) -> SpringTerms:
        """At a state of legs, with the platform at (R, p)."""
        m, rows, arrays = group.free_size, list(group.rows), group.spring_arrays
        own = arrays.at(group, state, R, p, share.value)
        count = 3 * len(arrays.length)
        J, J_t = own.J.reshape(count, m), own.J_t.reshape(count, 6)
        by_J, by_J_t = (own.D @ own.J).reshape(count, m), (own.D @ own.J_t).reshape(count, 6)
        # the platform moves both ends where it has them: its wrench is J_t^T force
        of_share, of_twist = J_t.T @ own.rate.ravel(), J_t.T @ by_J_t
        on_platform = arrays.on_platform * np.array([-1.0, 1.0])[:, None]
        f = (on_platform[..., None] * own.force).reshape(-1, 3)  # what the platform exerts
        arms = own.arms.reshape(-1, 3)
        turned = arms.T @ f
        of_twist[3:, 3:] += turned - np.trace(turned) * _IDENTITY  # sum of skew(f) skew(arm)
        wide = np.zeros((1, len(rows), group.size))
        wide[0, :, :m] = (J_t.T @ by_J)[rows]
        return SpringTerms(
            on_anchors(group, own.force),
            J.T @ by_J,
            J.T @ own.rate.ravel(),
            (J.T @ by_J_t)[:, rows],
            np.concatenate([np.sum(f, axis=0), np.sum(crossed(arms, f), axis=0)])[rows],
            Beside(wide, of_twist[np.ix_(rows, rows)][None], share.rate * of_share[None, rows]),
        )


def on_anchors(group: LegGroup, force: np.ndarray) -> list[np.ndarray]:
    """Forces (A, 3) on the anchors of each chain, from those of springs (S, 3) [N]."""
    found = [np.zeros((len(own.anchors), 3)) for own in group.chains]
    for side, i, chain, place in group.spring_arrays.on_chains:
        found[chain][place] += (1.0 if side == 0 else -1.0) * force[i]
    return found


def small_forces(
    group: LegGroup, at_rest: State, step: np.ndarray, twist: np.ndarray
) -> np.ndarray:
    """Forces of springs (S, 3) on their first points under small loads, tension among them.

    The coordinates and bodies of the legs move by a step (m,), the platform by a twist (r,).
    """
    arrays, moved = group.spring_arrays, np.zeros(6)
    moved[list(group.rows)] = twist
    own = arrays.at(group, group.unloaded(), at_rest.R, at_rest.p, 0.0)
    d = own.J @ step + own.J_t @ moved
    return (own.D @ d[..., None])[..., 0] + own.rate


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
        now = group.spring_arrays.at(group, own, state.R, state.p, share)
        for i, spring in enumerate(group.springs):
            length, tension = float(now.length[i]), float(now.tension[i])
            ends, energy = now.points[:, i], spring.energy(length, tension)
            found.append(LoadedSpring(spring.name, ends, length, tension, energy, spring.is_cable))
    return tuple(found)


def joined_legs(groups: Iterable[set[int]]) -> list[list[int]]:
    """Groups of legs, those that have legs in common as one; by their first legs."""
    found: list[set[int]] = []
    for own in groups:
        common = [other for other in found if other & own]
        found = [*(other for other in found if other not in common), own.union(*common)]
    return sorted(map(sorted, found))


@dataclass(frozen=True)
class HeldSprings:
    """The springs between bodies of a snapshot."""

    springs: tuple[PlacedBodySpring, ...]
    places: Mapping[str, tuple[int, int]]  # leg and chain of every ``leg/part``
    # legs that springs hold together; a spring between base and platform is with the first leg
    groups: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(snapshot: Snapshot, places: Mapping[str, tuple[int, int]]) -> HeldSprings:
        """The springs of a snapshot at one pose.

        Raises
        ------
        InputError
            When a spring names no body.
        """
        # a flexible platform holds all legs together
        groups = [] if snapshot.platform is None else [set(range(len(snapshot.legs)))]
        for spring in snapshot.springs:
            legs = set()
            for name in spring.bodies:
                if name in places:
                    legs.add(places[name][0])
                elif name not in (BASE, PLATFORM):
                    what = f"{BASE}, {PLATFORM} or leg/part"
                    raise unknown_name(f"body of spring {spring.name!r}", name, places, what)
            groups.append(legs or {0})
        return HeldSprings(snapshot.springs, places, tuple(map(tuple, joined_legs(groups))))

    def group_of(self, leg: int) -> int:
        """Which legs a leg is with: those of a group, -1 where it has no springs."""
        return next((i for i, group in enumerate(self.groups) if leg in group), -1)

    def joined(self, groups: Sequence[LegGroup]) -> tuple[LegGroup, ...]:
        """The legs, those that springs hold together in one group of them all."""
        found, held = [], {}
        for group in groups:
            i = self.group_of(group.indices[0])
            if i < 0:
                found.append(group)
            else:
                held.setdefault(i, []).append(group)
        return (*found, *(self._joined(i, legs) for i, legs in held.items()))

    def _joined(self, number: int, groups: Sequence[LegGroup]) -> LegGroup:
        legs = sorted(groups, key=lambda group: group.indices)
        first = legs[0]
        chains, points, owners, couplings = [], [], [], []
        offsets: dict[int, int] = {}
        for i, leg in enumerate(legs):
            shift, offsets[leg.indices[0]] = len(points), len(chains)
            couplings += [own.shifted(len(chains)) for own in leg.couplings]
            chains += [
                replace(
                    chain,
                    start=None if chain.start is None else chain.start + shift,
                    end=None if chain.end is None else chain.end + shift,
                )
                for chain in leg.chains
            ]
            points += leg.points
            owners += [i] * len(leg.chains)
        return replace(
            first,
            indices=tuple(leg.indices[0] for leg in legs),
            names=tuple(leg.names[0] for leg in legs),
            chains=tuple(chains),
            points=tuple(points),
            owners=tuple(owners) if len(legs) > 1 else (),
            springs=self._finite(number, offsets),
            couplings=tuple(couplings),
        )

    def _finite(self, number: int, offsets: Mapping[int, int]) -> tuple[FiniteBodySpring, ...]:
        """The springs of one group, whose chains begin at an offset for each leg."""
        counts: dict[int, int] = {}
        found = []
        for spring in self.springs:
            legs = {self.places[name][0] for name in spring.bodies if name in self.places}
            if self.group_of(min(legs or {0})) != number:
                continue
            ends = []
            for name, at in zip(spring.bodies, spring.points, strict=True):
                point = np.asarray(at, dtype=float)
                if name not in self.places:
                    ends.append(Anchor(point, on_platform=name == PLATFORM))
                    continue
                leg, own = self.places[name]
                chain = offsets[leg] + own
                ends.append(Anchor(point, chain, counts.get(chain, 0)))
                counts[chain] = counts.get(chain, 0) + 1
            length = float(np.linalg.norm(ends[1].point - ends[0].point))
            tension = spring.tension + spring.stiffness * (length - spring.length)
            found.append(
                FiniteBodySpring(spring.name, (ends[0], ends[1]), spring.stiffness, length, tension)
            )
        return tuple(found)
