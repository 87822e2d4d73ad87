"""Legs under load on recorded entries: elements, equations, steps, and what acts on bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robostiff.frozen import frozen, replace
from robostiff.kinematics.frames import Placing
from robostiff.model import PlacedBodySpring, PlacedSpring
from robostiff.model.body_spring import BodySpring
from robostiff.record import Entry, as_part, is_zero, reciprocal, square_root, usual_size
from robostiff.spatial import Space
from robostiff.statics.chains.beam_bowing import Elements, elastic_elements, in_series
from robostiff.statics.chains.elements import Element, FiniteChain, FiniteJoint, FiniteSpring
from robostiff.statics.chains.legs import LegEquations, Legs, State
from robostiff.statics.chains.numbers import Component
from robostiff.statics.kernels.elimination import SymmetricElimination

# Of the product of two diagonal entries of a compliance: a square beside it that is rounding.
_LOST = 1e-20


@frozen
class RecordedElements(Elements):
    """Of entries, by those in numbers."""

    kind: ClassVar[type] = object
    length: float  # of the robot [m]
    # The elements of an elastic part in numbers, by its leg and its name: whether it bows
    like: Mapping[tuple[str, str], list[FiniteSpring]]

    @staticmethod
    def of(legs: Legs, space: Space, length: float) -> RecordedElements:
        """By the legs of a robot in numbers."""
        like: dict[tuple[str, str], list[FiniteSpring]] = {}
        for chain in legs.chains:
            for e in chain.elements:
                if isinstance(e, FiniteSpring):
                    like.setdefault((chain.owner.name, e.name), []).append(e)
        return RecordedElements(space, length, like)

    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part as one spring, or a beam as elements."""
        like = self.like[leg, spring.name]
        own, bows = spring.elasticity, like[0].bows
        rotation, free = map(self.array, (spring.rotation, own.freedoms))
        each = [*map(self.array, own.pieces if len(like) > 1 else (own.compliance,))]
        lengths = (2 * C[1, 5] / C[5, 5] if bows or len(each) > 1 else None for C in each)
        found = elastic_elements(
            self.space,
            rotation,
            [*zip(each, lengths, strict=True)],
            free,
            len(like) // len(each),
            self._modes_of,
            bows=bows,
            inner=bool(np.any(like[0].bending.b)),
        )
        return in_series(found, spring)

    def _modes_of(self, C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Twists F with ``sum F F^T = C``, rotations first, as in bending; and freedoms."""
        S, modes = C.copy(), []
        for i in reversed(range(len(C))):
            pivot = S[i, i]
            if usual_size(pivot) <= _LOST**0.5 * usual_size(C[i, i]):
                continue
            column = S[:, i] * reciprocal(square_root(pivot))
            modes.append(column)
            for a, b in np.ndindex(i + 1, i + 1):
                if not (is_zero(column[a]) or is_zero(column[b])):
                    rest = S[a, b] - column[a] * column[b]
                    size = usual_size(C[a, a]) * usual_size(C[b, b])
                    S[a, b] = 0 if usual_size(rest) ** 2 <= _LOST * size else rest
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


class MovingBody(NamedTuple):
    """A rigid body: its axes (3, 3), and where its own point is (3,) [m]."""

    R: np.ndarray
    p: np.ndarray


@frozen
class MovedBody:
    """A body that has moved from its unloaded posture: a shift, and a quaternion."""

    name: str  # its seven coordinates begin with it
    origin: np.ndarray  # (3,) of entries and numbers: its point at the unloaded posture [m]

    @property
    def coordinates(self) -> list[str]:
        """Names: of the shift, and of the quaternion, scalar first."""
        return [f"{self.name}.{part}" for part in ("x", "y", "z", "q0", "q1", "q2", "q3")]

    def unknowns(self, length: float) -> dict[str, tuple[float, float]]:
        """Its coordinates where it is unloaded, and their sizes in a robot of this length [m]."""
        sizes = [(0.0, 1e-3 * length)] * 3 + [(1.0, 1e-3)] + [(0.0, 1e-3)] * 3
        return dict(zip(self.coordinates, sizes, strict=True))

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

    def after_step(self, values: Mapping[str, Any], twist: np.ndarray) -> dict[str, Any]:
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


@frozen
class RecordedLegs:
    """Legs whose coordinates, wrenches and bodies are unknowns, numbered as those of `Legs`.

    Values of axial forces of beams are named by the numbers behind them. A body that an empty chain
    joins with the platform is the platform itself.
    """

    legs: Legs
    length: float  # of the robot [m]
    force: float  # under which the platform moves by about a thousandth of that [N]

    @cached_property
    def twist(self) -> range:
        """Numbers of the twist of the platform in the elimination."""
        return range(self.legs.numbers.total, self.legs.numbers.total + len(self.legs.rows))

    @cached_property
    def lengths(self) -> np.ndarray:
        """What makes moments of forces, and shifts of turns (r,) [m]; 1 of those in turning."""
        return np.array([self.length if row < 3 else 1.0 for row in self.legs.rows])

    @cached_property
    def platform(self) -> MovedBody:
        """The platform."""
        return MovedBody("platform", self.legs.platform_point)

    @cached_property
    def bodies(self) -> dict[int, MovedBody]:
        """The bodies between its chains."""
        on_platform = [chain.start for chain in self.legs.chains if _is_platform(chain)]
        points = enumerate(self.legs.points)
        return {b: MovedBody(f"b{b}", p) for b, p in points if b not in on_platform}

    @cached_property
    def sizes(self) -> list[float]:
        """A unit of each coordinate: a radian, or the length of the robot [m]."""
        elements = (e for chain in self.legs.chains for e in chain.elements)
        return [size for e in elements for size in [unit(e, self.length)] * e.size]

    @cached_property
    def drives(self) -> dict[str, tuple[int, Any]]:
        """Elastic joints, by ``leg/joint``: numbers of their coordinates, and stiffnesses."""
        found, at = {}, self.legs.numbers
        for (c, k), place in at.places.items():
            chain = self.legs.chains[c]
            e = chain.elements[k]
            if isinstance(e, FiniteJoint) and not is_zero(e.stiffness):
                found[f"{chain.owner.name}/{e.name}"] = int(at.x[place.start]), e.stiffness
        return found

    @cached_property
    def samples(self) -> dict[str, float]:
        """Sizes of coordinates, wrenches and axial forces under the force, by their names."""
        legs, at, multipliers = self.legs, self.legs.numbers, {}
        usual = dict(zip(at.x.tolist(), [1e-3 * size for size in self.sizes], strict=True))
        for W, chain in zip(at.W.tolist(), legs.chains, strict=True):
            if not _is_platform(chain):
                usual |= dict(zip(W, self.force * self.length / self.lengths, strict=True))
        for u, coupling in zip(at.multipliers.tolist(), legs.rigid, strict=True):
            multipliers[u] = self.force * self.length / unit(coupling.drive, self.length)
        found = {f"u{u}": float(size) for u, size in (usual | multipliers).items()}
        return found | {f"u{at.total + i}": self.force for i in range(len(legs.beams))}

    @cached_property
    def unknowns(self) -> dict[str, tuple[float, float]]:
        """All unknowns at the unloaded posture, and sizes that they have under the force."""
        found = self.platform.unknowns(self.length)
        found |= {name: (0.0, size) for name, size in self.samples.items()}
        for body in self.bodies.values():
            found |= body.unknowns(self.length)
        return found

    def add_to(
        self, elimination: SymmetricElimination, values: Mapping[str, Any], share: int
    ) -> tuple[LegEquations, np.ndarray]:
        """Add their equations to those of the platform, and eliminate their unknowns.

        Loads and preloads act, or, at the share 0, do not. Returns the equations, and the moment
        that they take from the platform (3,).
        """
        legs, at, rows = self.legs, self.legs.numbers, list(self.legs.rows)
        platform = self.platform.moved(values)
        places = [
            self.bodies[b].moved(values) if b in self.bodies else platform
            for b in range(len(legs.points))
        ]
        places += platform, MovingBody(np.eye(3, dtype=int), np.zeros(3, dtype=int))
        u = _entries([values.get(f"u{i}", 0) for i in range(at.total + len(legs.beams))])
        state = State(
            u[at.x],
            u[at.W],
            _entries([x for R, _ in places for x in R.flat]).reshape(-1, 3, 3),
            _entries([x for _, p in places for x in p]).reshape(-1, 3),
            u[at.multipliers],
            u[at.total :],
        )
        eq = legs.equations(state, share)
        units = np.ones(at.total)
        units[at.bodies], units[at.W] = self.lengths, self.lengths
        units[at.multipliers] = [unit(coupling.drive, self.length) for coupling in legs.rigid]
        for number, (size, residual) in enumerate(zip(units.tolist(), eq.r, strict=True)):
            elimination.unknown(number, size)
            elimination.add_right(number, -residual)
        for block, A in zip(at.blocks, eq.A, strict=True):
            for numbers, rates in zip(block.at.tolist(), A, strict=True):
                for i, j in zip(*np.tril_indices(len(numbers)), strict=True):
                    elimination.add(numbers[i], numbers[j], rates[i, j])
        moment = np.zeros(6, dtype=int).astype(object)
        for c in at.on_platform:
            start, W = legs.chains[c].start, state.W[c]
            force = eq.r[at.bodies[start]] if _is_platform(legs.chains[c]) else W
            moment[rows] = moment[rows] + force
            for number, t, force in zip(at.W[c].tolist(), self.twist, W + eq.half[c], strict=True):
                elimination.add(number, t, -1)
                elimination.add_right(t, -force)
        elimination.pivots += [x for x in eq.terms.beams.pivots.flat if isinstance(x, Entry)]
        for spring, length in zip(legs.springs, eq.pulls.length if eq.pulls else (), strict=True):
            if spring.constant and isinstance(length, Entry):
                elimination.pivots.append(as_part(length))
        for component in at.components:
            self._eliminate(elimination, component)
        return eq, moment[3:]

    def _eliminate(self, elimination: SymmetricElimination, component: Component) -> None:
        """Eliminate a component."""
        legs, at = self.legs, self.legs.numbers
        follow = [
            at.x[legs.numbers.places[one.place]][0] for one in legs.couplings if not one.is_rigid
        ]
        elastic, free, multipliers = [], [], at.multipliers[component.rigid].tolist()
        for c in component.chains:
            stiffness = (k for e in legs.chains[c].elements for k in np.ravel(e.stiffness))
            for u, k in zip(at.x[at.coordinates[c]].tolist(), stiffness, strict=True):
                (free if is_zero(k) and u not in follow else elastic).append(u)
            multipliers += at.W[c].tolist()
        carried, rest = [], set(component.bodies)
        # Each body moves as the shortest chain that leads to it from the base or the platform.
        chains = sorted(component.chains, key=lambda c: len(at.x[at.coordinates[c]]))
        while rest:
            ends = ((c, rest & {legs.chains[c].start, legs.chains[c].end}) for c in chains)
            c, found = next((c, found) for c, found in ends if len(found) == 1)
            rest -= found
            carried += zip(at.bodies[found.pop()].tolist(), at.W[c].tolist(), strict=True)
        elimination.eliminate(elastic, free, multipliers, carried, self.force * self.length)

    def after_step(
        self,
        values: Mapping[str, Any],
        eq: LegEquations,
        found: Mapping[int, Any],
        platform_twist: np.ndarray,
    ) -> tuple[dict[str, Any], list[Any]]:
        """All unknowns after a step; and steps of coordinates, in radians and lengths."""
        rows, at = list(self.legs.rows), self.legs.numbers
        step = _entries([found[u] for u in range(at.total)])[:, None]
        step[at.W], step[at.multipliers] = -step[at.W], -step[at.multipliers]
        step = self.legs.steps(eq, step, platform_twist[rows][:, None])[:, 0]
        after = {name: values[name] + step[int(name[1:])] for name in self.samples}
        after |= self.platform.after_step(values, platform_twist)
        for b, body in self.bodies.items():
            twist = np.zeros(6, dtype=int).astype(object)
            twist[rows] = step[at.bodies[b]]
            after |= body.after_step(values, twist)
        pairs = zip(step[at.x], self.sizes, strict=True)
        return after, [x * (1 / size) for x, size in pairs]


def _is_platform(chain: FiniteChain) -> bool:
    """Whether the body before a chain is the platform itself."""
    return not chain.elements and chain.end is None


def _entries(values: Sequence[Any]) -> np.ndarray:
    """Entries and numbers (n,)."""
    return np.array([*values, None], dtype=object)[:-1]


#: What places the frames of bodies, by their names.
Frames = Mapping[str, Placing]
#: A body, and a point in its frame [m].
Site = tuple[str, tuple[float, float, float]]


def placed_springs(
    springs: Sequence[BodySpring], placed: Sequence[PlacedBodySpring], frames: Frames
) -> tuple[PlacedBodySpring, ...]:
    """Springs between bodies of a robot, as they are `placed` in numbers, with ends on entries."""
    found = []
    for spring, numeric in zip(springs, placed, strict=True):
        points = []
        for end in spring.between:
            R, p = frames[end.body]()
            points.append(np.array(p, dtype=object) + np.array(R, dtype=object) @ end.at)
        found.append(replace(numeric, points=(points[0], points[1])))
    return tuple(found)


def frame_of(frames: Frames, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Axes and origin of a body by its name, or that of one of its freedoms or beams."""
    part = name.partition("[")[0].partition(".beam")[0]
    placing = frames.get(name) or frames.get(part)
    return placing and placing()
