"""Legs under load on recorded entries: their elements, equations, eliminated, and steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.record import Entry, is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import Space, cross
from robostiff.statics.chains.beam_bowing import elastic_element, in_series
from robostiff.statics.chains.body_springs import Pulls
from robostiff.statics.chains.elements import (
    NOBODY,
    Element,
    FiniteCoupling,
    FiniteJoint,
    FiniteSpring,
)
from robostiff.statics.chains.legs import Legs, LegState
from robostiff.statics.chains.moving_chain import ChainTerms
from robostiff.statics.kernels.elimination import SymmetricElimination

# Of the product of two diagonal entries of a compliance: a square beside it that is rounding.
_LOST = 1e-20


@dataclass(frozen=True)
class RecordedElements:
    """What makes elements of parts on entries, by those in numbers.

    Attributes
    ----------
    like : mapping of (str, str) to list of FiniteSpring
        The elements of an elastic part in numbers, by its leg and its name: whether it bows.
    space : Space
    length : float
        Of the robot [m].
    """

    like: Mapping[tuple[str, str], list[FiniteSpring]]
    space: Space
    length: float

    @staticmethod
    def of(legs: Legs, space: Space, length: float) -> RecordedElements:
        """By the legs of a robot in numbers."""
        like: dict[tuple[str, str], list[FiniteSpring]] = {}
        for chain in legs.chains:
            for e in chain.elements:
                if isinstance(e, FiniteSpring):
                    like.setdefault((chain.owner.name, e.name), []).append(e)
        return RecordedElements(like, space, length)

    def array(self, values: Any) -> np.ndarray:
        """Values as an array of entries."""
        return np.array(values, dtype=object)

    def joint(self, freedom: PlacedFreedom) -> FiniteJoint:
        """A joint, whose drive does not push."""
        k = 0 if freedom.stiffness is None else freedom.stiffness
        point, axis = self.array(freedom.point), self.array(freedom.axis)
        return FiniteJoint(freedom.name, point, axis, freedom.turns, freedom.advance(1), k, 0)

    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part as one spring, or a beam as elements."""
        like = self.like[leg, spring.name]
        values = spring.rotation, spring.elasticity.compliance, spring.elasticity.freedoms
        rotation, C, free = map(self.array, values)
        beam = 2 * C[1, 5] / C[5, 5] if like[0].bows else None
        inner, parts = bool(np.any(like[0].bending.b)), len(like)
        own = elastic_element(
            self.space, rotation, (C, free), beam, parts, self._modes_of, inner=inner
        )
        return in_series(own, spring, 0 if beam is None else beam, parts)

    def _modes_of(self, C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        modes = _modes(C)
        V, stiffness = [], []
        for i, column in enumerate([*modes, *free.T]):
            shifts = np.arange(len(column)) < self.space.translations
            units = np.where(shifts, self.length, 1.0).tolist()
            sizes = [usual_size(x) / unit for x, unit in zip(column, units, strict=True)]
            size = max(*sizes, 1e-300)
            V.append(column * (1 / size))
            stiffness.append(1 / size**2 if i < len(modes) else 0)
        columns = np.array(V, dtype=object).T.reshape(len(C), len(V))
        return columns, np.array([*stiffness, None], dtype=object)[:-1]


def unit(element: Element, length: float) -> float:
    """A unit of motion of its coordinates: a radian, or the length of the robot [m].

    Coordinates of elastic parts on entries are of about this size themselves.
    """
    return length if isinstance(element, FiniteJoint) and not element.turns else 1.0


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


class MovingBody(NamedTuple):
    """A rigid body: its axes (3, 3), and where its own point is (3,) [m]."""

    R: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class MovedBody:
    """A body that has moved from its unloaded posture: a shift, and a quaternion."""

    name: str  # its seven coordinates begin with it
    origin: np.ndarray  # (3,) of entries and numbers: its point at the unloaded posture [m]

    @property
    def coordinates(self) -> list[str]:
        """Names: of the shift, and of the quaternion, scalar first."""
        return [f"{self.name}.{own}" for own in ("x", "y", "z", "q0", "q1", "q2", "q3")]

    @property
    def start(self) -> dict[str, float]:
        """Where it is unloaded."""
        return dict(zip(self.coordinates, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), strict=True))

    def moved(self, values: Mapping[str, Any]) -> MovingBody:
        """The body at the values of its coordinates; its quaternion may have any length."""
        x, y, z, a, b, c, d = (values[name] for name in self.coordinates)
        bb, cc, dd = b * b, c * c, d * d
        by = 2 * reciprocal(a * a + bb + cc + dd)
        e, f, g = b * by, c * by, d * by
        bb, cc, dd, bc, bd, cd = b * e, c * f, d * g, b * f, b * g, c * g
        ab, ac, ad = a * e, a * f, a * g
        R = np.array(
            [
                [1 - (cc + dd), bc - ad, bd + ac],
                [bc + ad, 1 - (bb + dd), cd - ab],
                [bd - ac, cd + ab, 1 - (bb + cc)],
            ],
            dtype=object,
        )
        return MovingBody(R, self.origin + np.array([x, y, z], dtype=object))

    def stepped(self, values: Mapping[str, Any], twist: np.ndarray) -> dict[str, Any]:
        """Its coordinates after a twist (6,): a Cayley turn, alike to second order."""
        x, y, z, a, b, c, d = (values[name] for name in self.coordinates)
        p, q, r = twist[3:] * 0.5
        turned = (
            a - p * b - q * c - r * d,
            b + p * a + q * d - r * c,
            c + q * a + r * b - p * d,
            d + r * a + p * c - q * b,
        )
        after = (x + twist[0], y + twist[1], z + twist[2], *turned)
        return dict(zip(self.coordinates, after, strict=True))


@dataclass(frozen=True)
class RecordedCoupling:
    """A sum ``s = sum(a q)`` of coordinates that is the motion of a spring, or 0 where it is rigid.

    What it pushes with is an unknown of its own; see `FiniteCoupling`.
    """

    name: str  # its unknowns begin with it
    terms: Sequence[tuple[str, Any]]  # of (str, entry or number): coordinates, and a
    own: FiniteCoupling

    @property
    def push(self) -> str:
        """Name of what it pushes with [N or N m]."""
        return f"{self.name}.f"

    @property
    def motion(self) -> list[str]:
        """Name of the motion of its spring; none of a rigid one."""
        return [] if self.own.is_rigid else [f"{self.name}.s"]

    def add_to(
        self, elimination: SymmetricElimination, values: Mapping[str, Any], length: float
    ) -> None:
        """Add ``sum(a q) - s = 0`` and what pushes."""
        elimination.unknown(self.push, unit(self.own.drive, length))
        terms = [*self.terms, *((name, -1) for name in self.motion)]
        for name in self.motion:
            elimination.unknown(name, 1.0)
            k = self.own.drive.stiffness
            elimination.add(name, name, k)
            elimination.add_right(name, self.own.drive.preload - k * values[name])
        for name, factor in terms:
            elimination.add(self.push, name, factor)
            elimination.add_right(name, values[self.push] * factor)
            elimination.add_right(self.push, -(values[name] * factor))


@dataclass(frozen=True)
class RecordedLegs:
    """Legs whose coordinates and wrenches are unknowns."""

    legs: Legs
    length: float  # of the robot [m]

    @cached_property
    def names(self) -> list[str]:
        """Of all unknowns; what holds springs at the platform moves as the platform does."""
        found = [f"u{u}" for u in range(self.legs.numbers.total)]
        for chain in self.legs.chains:
            if chain.owner == NOBODY and chain.start is not None:
                for row, u in zip(
                    self.legs.rows, self.legs.numbers.bodies[chain.start], strict=True
                ):
                    found[u] = f"t{row}"
        return found

    def names_of(self, unknowns: Iterable[int]) -> list[str]:
        """Names of some unknowns."""
        return [self.names[u] for u in unknowns]

    @cached_property
    def sizes(self) -> dict[str, float]:
        """A unit of each coordinate: a radian, or the length of the robot [m]."""
        every = (e for chain in self.legs.chains for e in chain.elements)
        units = [size for e in every for size in [unit(e, self.length)] * e.size]
        return dict(zip(self.names_of(self.legs.numbers.x), units, strict=True))

    @cached_property
    def drives(self) -> dict[str, tuple[str, Any]]:
        """Elastic joints, by ``leg/joint``: names of their coordinates, and stiffnesses."""
        found = {}
        for c, chain in enumerate(self.legs.chains):
            own = iter(self.names_of(self.legs.numbers.x[self.legs.coordinates[c]]))
            for e in chain.elements:
                first, *_ = [next(own) for _ in range(e.size)]
                if isinstance(e, FiniteJoint) and not is_zero(e.stiffness):
                    found[f"{chain.owner.name}/{e.name}"] = first, e.stiffness
        return found

    @cached_property
    def wrenches(self) -> dict[int, list[str]]:
        """Names of the components of the wrenches of chains."""
        numbers = enumerate(self.legs.numbers.W)
        return {c: self.names_of(W) for c, W in numbers if self.legs.chains[c].owner != NOBODY}

    @cached_property
    def bodies(self) -> dict[int, MovedBody]:
        """The bodies between its chains; what holds springs at the platform is the platform."""
        held = [chain.start for chain in self.legs.chains if chain.owner == NOBODY]
        points = enumerate(self.legs.points)
        return {b: MovedBody(f"b{b}", p) for b, p in points if b not in held}

    @cached_property
    def axial(self) -> list[str]:
        """Names of the axial forces of its beams."""
        return [f"N{i}" for i in range(len(self.legs.beams))]

    @cached_property
    def couplings(self) -> list[RecordedCoupling]:
        """Its couplings."""
        legs, found = self.legs, []
        for i, own in enumerate(legs.couplings):
            names = [self.names_of(legs.numbers.x[legs.places[at]])[0] for at in own.terms]
            found.append(RecordedCoupling(f"c{i}", list(zip(names, own.factors, strict=True)), own))
        return found

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns at the unloaded posture."""
        found = dict.fromkeys([*self.sizes, *self.axial], 0.0)
        for names in self.wrenches.values():
            found |= dict.fromkeys(names, 0.0)
        for body in self.bodies.values():
            found |= body.start
        for own in self.couplings:
            found |= dict.fromkeys([own.push, *own.motion], 0.0)
        return found

    def samples(
        self, shares: np.ndarray, force: float, random: np.random.Generator
    ) -> dict[str, Any]:
        """Values of its unknowns somewhat off the unloaded posture, by shares of a load."""
        count, L = len(shares), self.length

        def small() -> np.ndarray:
            return 1e-3 * shares * random.uniform(-1, 1, count)

        found: dict[str, Any] = {name: size * small() for name, size in self.sizes.items()}
        found |= {name: 1e3 * force * small() for name in self.axial}
        for names in self.wrenches.values():
            for name, row in zip(names, self.legs.rows, strict=True):
                found[name] = 1e3 * force * (1.0 if row < 3 else L) * small()
        for body in self.bodies.values():
            x = [*(L * small() for _ in range(3)), np.ones(count)]
            found |= dict(zip(body.coordinates, [*x, *(small() for _ in range(3))], strict=True))
        for own in self.couplings:
            size = unit(own.own.drive, L)
            found[own.push] = 1e3 * force * (L / size) * small()
            found |= {name: size * small() for name in own.motion}
        return found

    def add_to(
        self,
        elimination: SymmetricElimination,
        values: Mapping[str, Any],
        platform: MovingBody,
        twist: Sequence[str],
        force: float,
        share: int,
    ) -> tuple[np.ndarray, list[Any]]:
        """Add their equations to those of the platform, and eliminate their unknowns.

        Loads and preloads act, or, at the share 0, do not. Returns the moment that they take from
        the platform (3,), and squares of turns of their parts.
        """
        legs, rows, at = self.legs, list(self.legs.rows), self.legs.numbers
        moved = {b: body.moved(values) for b, body in self.bodies.items()}
        places = [moved.get(b, platform) for b in range(len(legs.points))]
        every = (self.wrenches.get(c) for c in range(len(legs.chains)))
        wrenches = [[values[name] for name in own] if own else [0] * len(rows) for own in every]
        state = LegState(
            _entries([values[name] for name in self.sizes]),
            _entries([W for own in wrenches for W in own]).reshape(-1, len(rows)),
            _entries([x for R, _ in places for x in R.flat]).reshape(-1, 3, 3),
            _entries([x for _, p in places for x in p]).reshape(-1, 3),
            np.zeros(0),
            _entries([values[name] for name in self.axial]),
        )
        pulls = legs.spring_arrays.at(legs, state, share) if legs.springs else None
        terms, moment = legs.terms(state, pulls, share), np.zeros(6, dtype=int).astype(object)
        for name in self.sizes:
            elimination.unknown(name, 1.0)
        for u in (*at.bodies[[*self.bodies]], *at.W[[*self.wrenches]]):
            for name, row in zip(self.names_of(u), rows, strict=True):
                elimination.unknown(name, self.length if row < 3 else 1.0)
        a, b = (self.names_of(at.columns[own]) for own in legs.arrays.pairs)
        for one, other, value in zip(a, b, terms.tangent, strict=True):
            elimination.add(one, other, value)
        for name, value in zip(self.names_of(at.columns), terms.gradient, strict=True):
            elimination.add_right(name, -value)
        for c, chain in enumerate(legs.chains):
            if c not in self.wrenches:  # what holds springs is the platform itself
                moment[rows] = moment[rows] + terms.gradient[legs.arrays.columns[c]]
                continue
            if chain.end is None:
                moment[rows] = moment[rows] + state.W[c]
            end = platform if chain.end is None else places[chain.end]
            ends = twist if chain.end is None else self.names_of(at.bodies[chain.end])
            self._close(elimination, c, ends, terms, end, state.W[c])
        self._add_beams(elimination, terms)
        if pulls is not None:
            self._add_springs(elimination, pulls)
        for own in self.couplings:
            own.add_to(elimination, values, self.length)
        for chains, inner, _ in legs.components:
            self._eliminate(elimination, chains, inner, force * self.length)
        return moment[3:], [*terms.turns.flat]

    def _eliminate(
        self,
        elimination: SymmetricElimination,
        chains: Sequence[int],
        inner: Sequence[int],
        by_loads: float,
    ) -> None:
        """Eliminate a component, of some chains and bodies between them."""
        legs, at = self.legs, self.legs.numbers
        elastic, free, left = [], [], [b for b in inner if b in self.bodies]
        multipliers, carried = [], []
        for c in (c for c in chains if c in self.wrenches):
            stiffness = (k for e in legs.chains[c].elements for k in np.ravel(e.stiffness))
            own = self.names_of(at.x[legs.coordinates[c]])
            for name, k in zip(own, stiffness, strict=True):
                (free if is_zero(k) else elastic).append(name)
            multipliers += self.wrenches[c]
            end = legs.chains[c].end
            if end in left:
                left.remove(end)
                carried += zip(self.names_of(at.bodies[end]), self.wrenches[c], strict=True)
        for own in (own for own in self.couplings if own.own.place[0] in chains):
            elastic += own.motion
            multipliers.append(own.push)
        elimination.eliminate(elastic, free, multipliers, carried, by_loads)

    def _add_springs(self, elimination: SymmetricElimination, pulls: Pulls) -> None:
        """Add the stiffness of springs between bodies."""
        K = pulls.stiffness
        for u, v in zip(*np.triu_indices(len(K)), strict=True):
            elimination.add(self.names[u], self.names[v], K[u, v])
        for spring, length in zip(self.legs.springs, pulls.length, strict=True):
            if spring.constant and isinstance(length, Entry):
                elimination.pivots.append(length * (1 / usual_size(length)))

    def _close(
        self,
        elimination: SymmetricElimination,
        c: int,
        ends: Sequence[str],
        terms: ChainTerms,
        end: MovingBody,
        W: np.ndarray,
    ) -> None:
        """Add the closure of a chain, whose end moves by some unknowns."""
        to, R, columns = end.R, terms.R[c], self.legs.arrays.columns[c]
        D = [[R[i] @ to[j] for j in range(3)] for i in range(3)]
        turn = [(D[i][j] - D[j][i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))]
        gap, moving = (
            [*(terms.P[c] - end.p), *turn],
            self.names_of(self.legs.numbers.columns[columns]),
        )
        # what is left of the gap turns the axes of the multiplier half as far, as steps do
        m = np.zeros(6, dtype=int).astype(object)
        m[list(self.legs.rows)] = W
        half = [0, 0, 0, *(cross(m[3:], np.array(turn, dtype=object)) * 0.5)]
        for i, (name, row) in enumerate(zip(self.wrenches[c], self.legs.rows, strict=True)):
            for own, rate in zip(moving, terms.J[columns, row], strict=True):
                elimination.add(name, own, rate)
            elimination.add(name, ends[i], -1)
            elimination.add_right(name, -gap[row])
            elimination.add_right(ends[i], -W[i] - half[row])

    def _add_beams(self, elimination: SymmetricElimination, terms: ChainTerms) -> None:
        """Let axial forces of beams follow the coordinates."""
        beams, numbers = terms.beams, self.legs.numbers.beams
        for i, (name, (_, _, beam)) in enumerate(zip(self.axial, self.legs.beams, strict=True)):
            rates = zip(self.names_of(numbers[i, : beam.size]), beams.rate[i], strict=False)
            elimination.follows(name, beams.missing[i], dict(rates))
        elimination.pivots += [own for own in beams.pivots.flat if isinstance(own, Entry)]

    def stepped(
        self, values: Mapping[str, Any], found: Mapping[str, Any], platform_twist: np.ndarray
    ) -> tuple[dict[str, Any], list[Any]]:
        """Its unknowns after a step; and steps of its coordinates, in radians and lengths."""
        rows = list(self.legs.rows)
        after: dict[str, Any] = {}
        twists: dict[int | None, np.ndarray] = {None: platform_twist}
        for b, body in self.bodies.items():
            twists[b] = twist = np.zeros(6, dtype=int).astype(object)
            twist[rows] = [found[name] for name in self.names_of(self.legs.numbers.bodies[b])]
            after |= body.stepped(values, twist)
        after |= {name: values[name] + found[name] for name in (*self.sizes, *self.axial)}
        for c, names in self.wrenches.items():
            m = np.zeros(6, dtype=int).astype(object)
            m[rows] = [values[name] for name in names]
            # the multiplier's step is that of the wrench in axes that turn half as far
            turn = twists[self.legs.chains[c].end][3:]
            lag = np.concatenate([np.zeros(3, dtype=int), cross(m[3:], turn) * 0.5])
            for name, row in zip(names, rows, strict=True):
                after[name] = values[name] - found[name] - lag[row]
        for own in self.couplings:
            after[own.push] = values[own.push] - found[own.push]
            for name in own.motion:
                after[name] = values[name] + found[name]
        return after, [found[name] * (1 / size) for name, size in self.sizes.items()]


def _entries(values: Sequence[Any]) -> np.ndarray:
    """Entries and numbers (n,)."""
    return np.array([*values, None], dtype=object)[:-1]
