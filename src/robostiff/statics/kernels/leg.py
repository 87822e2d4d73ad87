"""A leg under load on recorded entries: its chains, the bodies between them, coupled joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.model import CoupledFreedom, PlacedFreedom, PlacedLeg
from robostiff.record import Entry, is_zero, reciprocal
from robostiff.recorded import RecordedRobot
from robostiff.recorded.leg import RecordedLeg
from robostiff.spatial import Space, cross
from robostiff.statics.chains.chain import (
    BodyLoad,
    ChainTerms,
    Element,
    FiniteChain,
    FiniteJoint,
    FiniteSpring,
)
from robostiff.statics.chains.moving_chain import MovingChains
from robostiff.statics.kernels.elimination import SymmetricElimination
from robostiff.statics.kernels.forces_on_bodies import RecordedBodySpring, SpringEnds
from robostiff.statics.kernels.motion import (
    Body,
    identity,
    recorded_joint,
    recorded_springs,
    units,
)
from robostiff.statics.kernels.strut import RecordedStrut, recorded_strut
from robostiff.statics.loading.from_snapshot import LegWalk


@dataclass(frozen=True)
class RecordedCoupling:
    """A sum ``s = sum(a q)`` of coordinates that is the motion of a spring, or 0 where it is rigid.

    What it pushes with is an unknown of its own; see `FiniteCoupling`.
    """

    name: str  # its unknowns begin with it
    terms: tuple[tuple[str, Any], ...]  # tuple of (str, entry or number): coordinates, and a
    drive: FiniteJoint  # with the stiffness against s, and a preload
    is_rigid: bool

    @property
    def push(self) -> str:
        """Name of what it pushes with [N or N m]."""
        return f"{self.name}.f"

    @property
    def motion(self) -> list[str]:
        """Name of the motion of its spring; none of a rigid one."""
        return [] if self.is_rigid else [f"{self.name}.s"]

    def add_to(
        self, elimination: SymmetricElimination, values: Mapping[str, Any], length: float
    ) -> None:
        """Add ``sum(a q) - s = 0`` and what pushes."""
        (size,) = units(self.drive, length)
        elimination.unknown(self.push, size)
        terms = [*self.terms, *((name, -1) for name in self.motion)]
        for name in self.motion:
            elimination.unknown(name, 1.0)
            (k,), (preload,) = self.drive.stiffness, self.drive.preload
            elimination.add(name, name, k)
            pull = k * values[name] - preload
            elimination.add_right(name, -pull)
        for name, factor in terms:
            elimination.add(self.push, name, factor)
            elimination.add_right(name, values[self.push] * factor)
            elimination.add_right(self.push, -(values[name] * factor))


@dataclass(frozen=True)
class RecordedChain(FiniteChain):
    """A chain on entries (N = 1), whose unknowns begin with a name."""

    name: str = ""

    @property
    def coordinates(self) -> list[str]:
        """Names of its coordinates."""
        return [f"{self.name}.x{i}" for i in range(self.size)]

    @property
    def springs(self) -> list[Any]:
        """Stiffness of each coordinate; 0 where it is free."""
        return [k for e in self.elements for k in e.stiffness.flat]

    @property
    def axial(self) -> list[str | None]:
        """Names of the axial forces of its elastic parts; None of those that are no beams."""
        springs = (e for e in self.elements if isinstance(e, FiniteSpring))
        return [None if is_zero(e.axial[0]) else f"{self.name}.N{i}" for i, e in enumerate(springs)]

    def wrench(self, size: int) -> list[str]:
        """Names of the components of its wrench."""
        return [f"{self.name}.W{i}" for i in range(size)]


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

    def moved(self, values: Mapping[str, Any]) -> Body:
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
        return Body(R, self.origin, self.origin + np.array([x, y, z], dtype=object))

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
class RecordedLoadedLeg:
    """A leg whose coordinates and wrenches are unknowns, or several that springs hold together."""

    chains: tuple[RecordedChain, ...]
    bodies: tuple[MovedBody, ...]
    space: Space
    length: float  # of the robot [m]
    springs: tuple[RecordedBodySpring, ...] = ()  # that its bodies hold
    couplings: tuple[RecordedCoupling, ...] = ()

    @staticmethod
    def joined(legs: Mapping[int, RecordedLoadedLeg]) -> RecordedLoadedLeg:
        """Legs as one, by their numbers; springs between them are with the first."""
        chains: list[RecordedChain] = []
        bodies: list[MovedBody] = []
        offsets: dict[int | None, int] = {None: 0}

        def shifted(body: int | None) -> int | None:
            return None if body is None else body + len(bodies)

        for number, leg in legs.items():
            offsets[number] = len(chains)
            for own in leg.chains:
                chains.append(replace(own, start=shifted(own.start), end=shifted(own.end)))
            bodies += leg.bodies
        first = next(iter(legs.values()))
        springs = []
        anchors: list[list[BodyLoad]] = [[] for _ in chains]
        for own in {id(own): own for leg in legs.values() for own in leg.springs}.values():
            ends = []
            for end in own.ends:
                if end.chain is None:
                    ends.append(end)
                    continue
                c = end.chain + offsets[end.leg]
                place = len(chains[c].loads) + len(anchors[c])
                anchors[c].append(BodyLoad(end.after, end.point[None], _STILL[None]))
                ends.append(replace(end, chain=c, place=place))
            springs.append(replace(own, ends=(ends[0], ends[1])))
        chains = [
            replace(chain, anchors=tuple(own)) for chain, own in zip(chains, anchors, strict=True)
        ]
        couplings = tuple(own for leg in legs.values() for own in leg.couplings)
        return replace(
            first,
            chains=tuple(chains),
            bodies=tuple(bodies),
            springs=tuple(springs),
            couplings=couplings,
        )

    @property
    def start(self) -> dict[str, float]:
        """Its unknowns at the unloaded posture."""
        found: dict[str, float] = {}
        for chain in self.chains:
            names = *chain.coordinates, *filter(None, chain.axial), *chain.wrench(self.space.size)
            found |= dict.fromkeys(names, 0.0)
        for body in self.bodies:
            found |= body.start
        for own in self.couplings:
            found |= dict.fromkeys([own.push, *own.motion], 0.0)
        return found

    @property
    def at_rest(self) -> RecordedLoadedLeg:
        """The same, its springs relaxed and nothing acting on its bodies."""
        chains = tuple(replace(chain, loads=()) for chain in self.chains)
        return replace(self, chains=chains, springs=tuple(own.at_rest for own in self.springs))

    def samples(
        self, shares: np.ndarray, force: float, random: np.random.Generator
    ) -> dict[str, Any]:
        """Values of its unknowns somewhat off the unloaded posture, by shares of a load."""
        found: dict[str, Any] = {}
        count = len(shares)

        def small() -> np.ndarray:
            return 1e-3 * shares * random.uniform(-1, 1, count)

        for chain in self.chains:
            sizes = [s for e in chain.elements for s in units(e, self.length)]
            found |= {n: s * small() for n, s in zip(chain.coordinates, sizes, strict=True)}
            found |= {name: 1e3 * force * small() for name in chain.axial if name}
            for name, row in zip(chain.wrench(self.space.size), self.space.rows, strict=True):
                found[name] = 1e3 * force * (1.0 if row < 3 else self.length) * small()
        for body in self.bodies:
            x = [*(self.length * small() for _ in range(3)), np.ones(count)]
            found |= dict(zip(body.coordinates, [*x, *(small() for _ in range(3))], strict=True))
        for own in self.couplings:
            (size,) = units(own.drive, self.length)
            found[own.push] = 1e3 * force * (self.length / size) * small()
            found |= {name: size * small() for name in own.motion}
        return found

    def add_to(
        self,
        elimination: SymmetricElimination,
        values: Mapping[str, Any],
        platform: Body,
        twist: Sequence[str],
        force: float,
    ) -> tuple[np.ndarray, list[Any]]:
        """Add its equations to those of the platform, and eliminate its unknowns.

        Returns the moment that it takes from the platform (3,), and squares of turns of its parts.
        """
        rows, L = list(self.space.rows), self.length
        bodies = [body.moved(values) for body in self.bodies]
        motions = [[f"{body.name}.t{row}" for row in rows] for body in self.bodies]
        for names in motions:
            for name, row in zip(names, rows, strict=True):
                elimination.unknown(name, L if row < 3 else 1.0)
        elastic, free, multipliers, carried = [], [], [], []
        left = set(range(len(bodies)))
        turns: list[Any] = []
        moving, postures, names = [], [], []
        for chain in self.chains:
            begin, at_start = _BASE, []
            if chain.start is not None:
                begin, at_start = bodies[chain.start], motions[chain.start]
            end = platform if chain.end is None else bodies[chain.end]
            ends = begin.origin[None], end.origin[None]
            moving.append(MovingChains.of_one(chain, ends, rows if at_start else ()))
            x = np.array([[values[name] for name in chain.coordinates]], dtype=object)
            postures.append((x, begin.R, begin.at))
            names.append([*at_start, *chain.coordinates])
            for name in chain.coordinates:
                elimination.unknown(name, 1.0)
        held = [own.loaded(*at) for own, at in zip(moving, postures, strict=True)]
        ends_on = SpringEnds(platform, twist, rows, held, names)
        pulls, moments = ends_on.add(self.springs, elimination)
        for c, chain in enumerate(self.chains):
            W = np.zeros(6, dtype=int).astype(object)
            W[rows] = [values[name] for name in chain.wrench(len(rows))]
            end = platform if chain.end is None else bodies[chain.end]
            axial = [0 if name is None else values[name] for name in chain.axial]
            axial = np.array([[*axial, None]], dtype=object)[:, :-1]
            terms = moving[c].terms(*postures[c], W[None], axial, 1.0, pulls[c])
            turns += terms.turns.flat
            wrench = chain.wrench(len(rows))
            ends = twist if chain.end is None else motions[chain.end]
            self._add_chain(elimination, chain, (names[c], ends), terms, _gap(terms, end), W)
            held = zip(chain.coordinates, chain.springs, strict=True)
            for name, k in held:
                (free if is_zero(k) else elastic).append(name)
            multipliers += wrench
            if chain.end in left:
                left.remove(chain.end)
                carried += zip(ends, wrench, strict=True)
            if chain.end is None:
                moments = moments + W[3:]
        for own in self.couplings:
            own.add_to(elimination, values, L)
            elastic += own.motion
            multipliers.append(own.push)
        elimination.eliminate(elastic, free, multipliers, carried, force * L)
        return moments, turns

    def _add_chain(
        self,
        elimination: SymmetricElimination,
        chain: RecordedChain,
        unknowns: tuple[Sequence[str], Sequence[str]],
        terms: ChainTerms,
        gap: np.ndarray,
        W: np.ndarray,
    ) -> None:
        """Add the equations of a chain, by the unknowns that move it and those of its end."""
        (names, ends), rows = unknowns, self.space.rows
        springs = [k for k, e in enumerate(chain.elements) if isinstance(e, FiniteSpring)]
        for i, (k, name) in enumerate(zip(springs, chain.axial, strict=True)):
            if name is not None:
                rates = zip(
                    chain.coordinates[chain.places[k]], terms.beams.rate[0, i], strict=False
                )
                elimination.follows(name, terms.beams.missing[0, i], dict(rates))
        pivots = terms.beams.pivots.flat
        elimination.pivots += [own for own in pivots if isinstance(own, Entry)]
        for name, row, end in zip(chain.wrench(len(rows)), rows, ends, strict=True):
            elimination.unknown(name, 1.0 if row >= 3 else self.length)
            for own, column in zip(names, terms.J[0, row], strict=True):
                elimination.add(name, own, column)
            elimination.add(name, end, -1)
            elimination.add_right(name, -gap[row])
            elimination.add_right(end, -W[row])
        for b, own in enumerate(names):
            elimination.add_right(own, -terms.gradient[0, b])
            for a in range(b + 1):
                elimination.add(names[a], own, terms.tangent[0, a, b])

    def stepped(
        self, values: Mapping[str, Any], found: Mapping[str, Any], platform_twist: np.ndarray
    ) -> tuple[dict[str, Any], list[Any]]:
        """Its unknowns after a step; and steps of its coordinates, in radians and lengths."""
        rows = list(self.space.rows)
        after: dict[str, Any] = {}
        moved: list[Any] = []
        twists = []
        for body in self.bodies:
            twist = np.zeros(6, dtype=int).astype(object)
            twist[rows] = [found[f"{body.name}.t{row}"] for row in rows]
            twists.append(twist)
            after |= body.stepped(values, twist)
        for chain in self.chains:
            sizes = [s for e in chain.elements for s in units(e, self.length)]
            for name, size in zip(chain.coordinates, sizes, strict=True):
                after[name] = values[name] + found[name]
                moved.append(found[name] * (1 / size))
            after |= {name: values[name] + found[name] for name in chain.axial if name}
            turn = (platform_twist if chain.end is None else twists[chain.end])[3:]
            names = chain.wrench(len(rows))
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
        return after, moved


_STILL = np.zeros(3, dtype=int).astype(object)
_BASE = Body(identity(), _STILL, _STILL)


def recorded_leg(
    walk: LegWalk,
    placed: PlacedLeg,
    own: RecordedLeg,
    loads: Mapping[int, Sequence[BodyLoad]],
    preload: Mapping[str, float],
    robot: RecordedRobot,
    springs: Sequence[RecordedBodySpring],
) -> RecordedLoadedLeg | RecordedStrut:
    """A leg on entries, of the same elements as in numbers.

    `walk` has it in numbers at one posture, `placed` on entries, `own` its stiffness without load.
    Forces act on its bodies by chain, preloads in ``leg/part``.
    """
    space, length = robot.space, robot.length
    alone = (p.alone if isinstance(p, CoupledFreedom) else p for p in placed.parts)
    parts = {part.name: part for part in alone}
    chains, origins = [], {}
    coordinates: dict[str, str] = {}
    for c, (start, end, like) in enumerate(walk.chains):
        elements: list[Element] = []
        names = [element.names[0] for element in like]
        for k, (name, element) in enumerate(zip(names, like, strict=True)):
            part = parts[name]
            if isinstance(part, PlacedFreedom):
                coordinates[name] = f"{placed.name}.{c}.x{sum(e.size for e in elements)}"
                elements.append(recorded_joint(part, preload.get(walk.prefix + name, 0)))
            elif isinstance(element, FiniteSpring) and name not in names[:k]:
                count = names.count(name)
                elements += recorded_springs(part, element, count, space, length)
        forces = tuple(loads.get(c, ()))
        name = f"{placed.name}.{c}"
        chains.append(RecordedChain(start, end, tuple(elements), forces, name=name))
        if end is not None and elements:
            origins.setdefault(end, elements[-1].point[0])
    couplings = tuple(
        RecordedCoupling(
            f"{placed.name}.{own.name}",
            tuple((coordinates[joint], a) for joint, a in own.sum if joint in coordinates),
            recorded_joint(own, preload.get(walk.prefix + own.name, 0)),
            own.stiffness is None,
        )
        for own in placed.parts
        if isinstance(own, CoupledFreedom) and len(own.sum) > 1
    )
    joints = (e for own in chains for e in own.elements if isinstance(e, FiniteJoint))
    pushed = any(not is_zero(joint.preload[0]) for joint in joints)
    alone = len(chains) == 1 and not (chains[0].loads or pushed or springs or couplings)
    if alone and space is Space.SPATIAL:
        strut = recorded_strut(chains[0].elements, own, length)
        if strut is not None:
            return strut
    bodies = tuple(MovedBody(f"{placed.name}.b{b}", origins[b]) for b in range(len(walk.points)))
    return RecordedLoadedLeg(tuple(chains), bodies, space, length, tuple(springs), couplings)


def _gap(terms: ChainTerms, end: Body) -> np.ndarray:
    """By how much the end of a chain is beyond the body there (6,)."""
    R, to = terms.R[0], end.R
    D = [[R[i] @ to[j] for j in range(3)] for i in range(3)]
    turn = [(D[i][j] - D[j][i]) * 0.5 for i, j in ((2, 1), (0, 2), (1, 0))]
    return np.array([*(terms.P[0] - end.at), *turn], dtype=object)
