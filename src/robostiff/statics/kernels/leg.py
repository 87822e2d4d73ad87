"""Legs under load on recorded entries: their elements, equations, eliminated, and steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robostiff.model import PlacedFreedom, PlacedSpring
from robostiff.record import Entry, is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import Space, cross
from robostiff.statics.chains.beam_bowing import elastic_element, in_series
from robostiff.statics.chains.body_springs import Pulls
from robostiff.statics.chains.chain import (
    NOBODY,
    ChainTerms,
    Element,
    FiniteCoupling,
    FiniteJoint,
    FiniteSpring,
    LegState,
    MovingBody,
)
from robostiff.statics.chains.chain_family import by_leg
from robostiff.statics.chains.legs import LegGroup
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

    side_by_side = False

    @staticmethod
    def of(groups: Iterable[LegGroup], space: Space, length: float) -> RecordedElements:
        """By the legs of a robot in numbers."""
        like: dict[tuple[str, str], list[FiniteSpring]] = {}
        for chain in (chain for group in groups for chain in group.chains):
            for row, owner in enumerate(chain.owners):
                for e in chain.elements:
                    if isinstance(e, FiniteSpring):
                        like.setdefault((owner.name, e.names[row]), []).append(e)
        return RecordedElements(like, space, length)

    def row(self, values: Any) -> np.ndarray:
        """Values as those of one leg (1, ...)."""
        if not np.ndim(values):
            return np.array([values, None], dtype=object)[:1]
        return np.array([values], dtype=object)

    def joint(self, freedom: PlacedFreedom, leg: str) -> FiniteJoint:
        """A joint, whose drive does not push."""
        del leg
        k = freedom.stiffness
        values = freedom.advance(1), 0 if k is None else k, 0, 0
        slide, stiffness, push, inertia = map(self.row, values)
        point, axis = self.row(freedom.point), self.row(freedom.axis)
        names, laws = (freedom.name,), (None,)
        return FiniteJoint(names, point, axis, freedom.turns, slide, stiffness, push, laws, inertia)

    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part as one spring, or a beam as elements."""
        like = self.like[leg, spring.name]
        values = spring.rotation, spring.elasticity.compliance, spring.elasticity.freedoms
        rotation, C, free = (np.array(own, dtype=object) for own in values)
        beam = 2 * C[1, 5] / C[5, 5] if np.any(like[0].axial) else None
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


def units(element: Element, length: float) -> list[float]:
    """A unit of motion of each coordinate: a radian, or the length of the robot [m].

    Coordinates of elastic parts on entries are of about this size themselves.
    """
    return [length if element.kind == "slide" else 1.0] * element.size


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
        return MovingBody(R[None], self.origin + np.array([[x, y, z]], dtype=object))

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
        (size,) = units(self.own.drive, length)
        elimination.unknown(self.push, size)
        terms = [*self.terms, *((name, -1) for name in self.motion)]
        for name in self.motion:
            elimination.unknown(name, 1.0)
            (k,), (preload,) = self.own.drive.stiffness, self.own.drive.preload
            elimination.add(name, name, k)
            pull = k * values[name] - preload
            elimination.add_right(name, -pull)
        for name, factor in terms:
            elimination.add(self.push, name, factor)
            elimination.add_right(name, values[self.push] * factor)
            elimination.add_right(self.push, -(values[name] * factor))


@dataclass(frozen=True)
class RecordedGroup:
    """Legs that are held together (N = 1), whose coordinates and wrenches are unknowns."""

    name: str  # its unknowns begin with it
    group: LegGroup
    length: float  # of the robot [m]

    @cached_property
    def coordinates(self) -> list[list[str]]:
        """Names of the coordinates of every chain."""
        chains = enumerate(self.group.chains)
        return [[f"{self.name}.{c}.x{i}" for i in range(chain.size)] for c, chain in chains]

    @cached_property
    def wrenches(self) -> list[list[str]]:
        """Names of the components of the wrenches of every chain."""
        size = range(len(self.group.rows))
        return [
            [] if chain.owners[0] == NOBODY else [f"{self.name}.{c}.W{i}" for i in size]
            for c, chain in enumerate(self.group.chains)
        ]

    @cached_property
    def bodies(self) -> dict[int, MovedBody]:
        """The bodies between its chains; what holds springs at the platform is the platform."""
        held = [chain.start for chain in self.group.chains if chain.owners[0] == NOBODY]
        points = enumerate(self.group.points)
        return {b: MovedBody(f"{self.name}.b{b}", p[0]) for b, p in points if b not in held}

    @cached_property
    def motions(self) -> list[list[str]]:
        """Names of the components of their twists."""
        names = [
            f"{self.bodies[b].name}." if b in self.bodies else ""
            for b in range(len(self.group.points))
        ]
        return [[f"{name}t{row}" for row in self.group.rows] for name in names]

    @cached_property
    def free(self) -> list[str]:
        """Names of coordinates and of components of twists, in the order of the group."""
        return [name for own in (*self.coordinates, *self.motions) for name in own]

    @cached_property
    def axial(self) -> list[str]:
        """Names of the axial forces of its beams."""
        return [f"{self.name}.N{i}" for i in range(len(self.group.beams))]

    @cached_property
    def couplings(self) -> list[RecordedCoupling]:
        """Its couplings."""
        found = []
        for i, own in enumerate(self.group.couplings):
            names = [
                self.coordinates[c][self.group.chains[c].places[k].start] for c, k in own.terms
            ]
            terms = list(zip(names, own.factors[0], strict=True))
            found.append(RecordedCoupling(f"{self.name}.c{i}", terms, own))
        return found

    @cached_property
    def sizes(self) -> dict[str, float]:
        """A unit of each coordinate: a radian, or the length of the robot [m]."""
        return {
            name: size
            for chain, names in zip(self.group.chains, self.coordinates, strict=True)
            for name, size in zip(
                names, (s for e in chain.elements for s in units(e, self.length)), strict=True
            )
        }

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns at the unloaded posture."""
        found: dict[str, float] = {}
        for names in (*self.coordinates, self.axial, *self.wrenches):
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
        for names in filter(None, self.wrenches):
            for name, row in zip(names, self.group.rows, strict=True):
                found[name] = 1e3 * force * (1.0 if row < 3 else L) * small()
        for body in self.bodies.values():
            x = [*(L * small() for _ in range(3)), np.ones(count)]
            found |= dict(zip(body.coordinates, [*x, *(small() for _ in range(3))], strict=True))
        for own in self.couplings:
            (size,) = units(own.own.drive, L)
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
        """Add its equations to those of the platform, and eliminate its unknowns.

        Loads and preloads act, or, at the share 0, do not. Returns the moment that it takes from
        the platform (3,), and squares of turns of its parts.
        """
        group, rows = self.group, list(self.group.rows)
        for b in self.bodies:
            for name, row in zip(self.motions[b], rows, strict=True):
                elimination.unknown(name, self.length if row < 3 else 1.0)
        for name in self.sizes:
            elimination.unknown(name, 1.0)
        none = np.zeros((1, len(rows)), dtype=int).astype(object)
        state = LegState(
            tuple(_row(values, names) for names in self.coordinates),
            tuple(_row(values, names) if names else none for names in self.wrenches),
            tuple(
                self.bodies[b].moved(values) if b in self.bodies else platform
                for b in range(len(self.motions))
            ),
            np.zeros((1, 0)),
            _row(values, self.axial),
        )
        pulls = group.spring_arrays.at(group, state, share) if group.springs else None
        if pulls is not None:
            self._add_springs(elimination, pulls)
        terms = group.family.terms([state], [pulls], share)
        moment = np.zeros(6, dtype=int).astype(object)
        elastic, free, multipliers, carried = [], [], [], []
        left = set(self.bodies)
        for c, chain in enumerate(group.chains):
            end, ends = platform, twist
            if chain.end is not None:
                end, ends = state.bodies[chain.end], self.motions[chain.end]
            self._add_chain(elimination, c, terms)
            if chain.owners[0] == NOBODY:  # what holds springs is the platform itself
                moment[rows] = moment[rows] + terms.gradient[c, group.family.columns[c]]
                continue
            self._close(elimination, c, ends, terms, end, state.W[c][0])
            stiffness = [k for e in chain.elements for k in e.stiffness.flat]
            for name, k in zip(self.coordinates[c], stiffness, strict=True):
                (free if is_zero(k) else elastic).append(name)
            multipliers += self.wrenches[c]
            if chain.end in left:
                left.remove(chain.end)
                carried += zip(ends, self.wrenches[c], strict=True)
            if chain.end is None:
                moment[rows] = moment[rows] + state.W[c][0]
        self._add_beams(elimination, terms)
        for own in self.couplings:
            own.add_to(elimination, values, self.length)
            elastic += own.motion
            multipliers.append(own.push)
        elimination.eliminate(elastic, free, multipliers, carried, force * self.length)
        return moment[3:], [*terms.turns.flat]

    def _add_springs(self, elimination: SymmetricElimination, pulls: Pulls) -> None:
        """Add the stiffness of springs between bodies."""
        K = pulls.stiffness
        for i, name in enumerate(self.free):
            for j in range(i, len(self.free)):
                elimination.add(name, self.free[j], K[i, j])
        for spring, length in zip(self.group.springs, pulls.length, strict=True):
            if spring.constant and isinstance(length, Entry):
                elimination.pivots.append(length * (1 / usual_size(length)))

    def _add_chain(self, elimination: SymmetricElimination, c: int, terms: ChainTerms) -> None:
        """Add the energy of a chain, by the unknowns that move it."""
        columns = self.group.family.columns[c]
        names = [self.free[k] for k in self.group.moving_places(c)]
        for b, (name, column) in enumerate(zip(names, columns, strict=True)):
            elimination.add_right(name, -terms.gradient[c, column])
            for a in range(b + 1):
                elimination.add(names[a], name, terms.tangent[c, columns[a], column])

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
        group, rows = self.group, self.group.rows
        names = [self.free[k] for k in group.moving_places(c)]
        to, R = end.R[0], terms.R[c]
        D = [[R[i] @ to[j] for j in range(3)] for i in range(3)]
        turn = [(D[i][j] - D[j][i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))]
        gap = [*(terms.P[c] - end.p[0]), *turn]
        # what is left of the gap turns the axes of the multiplier half as far, as steps do
        m = np.zeros(6, dtype=int).astype(object)
        m[list(rows)] = W
        half = [0, 0, 0, *(cross(m[3:], np.array(turn, dtype=object)) * 0.5)]
        for i, (name, row) in enumerate(zip(self.wrenches[c], rows, strict=True)):
            elimination.unknown(name, 1.0 if row >= 3 else self.length)
            for own, column in zip(names, terms.J[c, row, group.family.columns[c]], strict=True):
                elimination.add(name, own, column)
            elimination.add(name, ends[i], -1)
            elimination.add_right(name, -gap[row])
            elimination.add_right(ends[i], -W[i] - half[row])

    def _add_beams(self, elimination: SymmetricElimination, terms: ChainTerms) -> None:
        """Let axial forces of beams follow the coordinates."""
        known = self.group.family.places[0]
        missing, rate = (
            by_leg(own, 1)[0, known.beams] for own in (terms.beams.missing, terms.beams.rate)
        )
        for i, (name, (_, _, beam)) in enumerate(zip(self.axial, self.group.beams, strict=True)):
            names = [self.free[k] for k in known.beam_columns[i, : beam.size]]
            elimination.follows(name, missing[i], dict(zip(names, rate[i], strict=False)))
        pivots = terms.beams.pivots.flat
        elimination.pivots += [own for own in pivots if isinstance(own, Entry)]

    def stepped(
        self, values: Mapping[str, Any], found: Mapping[str, Any], platform_twist: np.ndarray
    ) -> tuple[dict[str, Any], list[Any]]:
        """Its unknowns after a step; and steps of its coordinates, in radians and lengths."""
        rows = list(self.group.rows)
        after: dict[str, Any] = {}
        twists = {}
        for b, body in self.bodies.items():
            twists[b] = twist = np.zeros(6, dtype=int).astype(object)
            twist[rows] = [found[name] for name in self.motions[b]]
            after |= body.stepped(values, twist)
        after |= {name: values[name] + found[name] for name in (*self.sizes, *self.axial)}
        for chain, names in zip(self.group.chains, self.wrenches, strict=True):
            if not names:
                continue
            turn = (platform_twist if chain.end is None else twists[chain.end])[3:]
            m = np.zeros(6, dtype=int).astype(object)
            m[rows] = [values[name] for name in names]
            # the multiplier's step is that of the wrench in axes that turn half as far
            lag = np.concatenate([np.zeros(3, dtype=int), cross(m[3:], turn) * 0.5])
            for name, row in zip(names, rows, strict=True):
                after[name] = values[name] - found[name] - lag[row]
        for own in self.couplings:
            after[own.push] = values[own.push] - found[own.push]
            for name in own.motion:
                after[name] = values[name] + found[name]
        return after, [found[name] * (1 / size) for name, size in self.sizes.items()]


def _row(values: Mapping[str, Any], names: Sequence[str]) -> np.ndarray:
    """Values of some unknowns (1, n)."""
    return np.array([*(values[name] for name in names), None], dtype=object)[None, :-1]
