"""Groups of equal legs from the bodies and members of an assembly, with what acts on them.

Members in series are one chain, from a body at which the assembly branches to the next. Elastic
parts lead from their first body to their second, so that a series of which some lead the other way
is several chains. Loops need no tree: each chain closes by itself. Chains begin at the base and end
at the platform: where one begins at the platform, or ends at the base, is a body between chains,
and an empty chain holds both together. Chains that meet in other bodies, coupled joints or springs
between bodies are one component; equal components lie side by side.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from typing import Any, Protocol

import numpy as np

from robostiff.errors import InputError
from robostiff.kinematics.spanning_tree import branches, connected_parts
from robostiff.model import PlacedBodySpring, PlacedFreedom, PlacedMass, PlacedSpring
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.record import is_zero
from robostiff.statics.chains.body_springs import (
    TO_PLATFORM,
    Anchor,
    FiniteBodySpring,
    held_on_platform,
)
from robostiff.statics.chains.chain import (
    NOBODY,
    BodyLoad,
    Element,
    FiniteChain,
    FiniteCoupling,
    FiniteJoint,
    Owner,
    Spot,
    unknown_name,
)
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.equations.vibration import CarriedMass, CarriedMasses
from robostiff.statics.loading.assembly import Assembly, Body, Member, NamedBody, SumOfJoints
from robostiff.statics.loading.given_loads import DeadForce, Laws

#: Members in series by their numbers, each with whether it is passed from its first body.
_Way = list[tuple[int, bool]]


class Elements(Protocol):
    """What makes elements of parts, of numbers or of entries of a record."""

    @property
    def side_by_side(self) -> bool:
        """Whether equal legs are computed together."""
        ...

    def joint(self, freedom: PlacedFreedom, leg: str) -> FiniteJoint:
        """A joint of a leg."""
        ...

    def spring(self, spring: PlacedSpring, leg: str) -> list[Element]:
        """An elastic part of a leg, or the elements of a beam."""
        ...

    def row(self, values: Any) -> np.ndarray:
        """Values as those of one leg (1, ...)."""
        ...


@dataclass(frozen=True)
class LoadedAssembly:
    """Groups of legs; forces on the platform; masses; where the bodies are that results list."""

    groups: tuple[LegGroup, ...]
    on_platform: list[DeadForce]
    masses: CarriedMasses
    nodes: Mapping[str, Spot | None]  # None of the platform


def loaded_groups(
    assembly: Assembly,
    elements: Elements,
    platform_point: np.ndarray,
    rows: tuple[int, ...],
    loads: Mapping[str, Sequence[DeadForce]],
    preload: Mapping[str, Any],
    gravity: np.ndarray,
    given: Mapping[str, Sequence[PlacedMass]],
    laws: Laws,
) -> LoadedAssembly:
    """An assembly with loads, ready to be solved.

    Forces act on bodies, preloads [N or N m] and laws of force in joints, by their names. Gravity
    [m/s^2] makes weights of the masses of the assembly, not of the `given` ones. Wrenches are about
    a point of the platform (3,) [m].

    Raises
    ------
    InputError
        When a name is no body that moves, or a preload is at no joint of one coordinate.
    """
    chains = _Chains.of(assembly, elements)
    chains.push(preload)
    chains.follow(laws)
    on_platform: list[DeadForce] = []
    for name, forces in loads.items():
        place, point = chains.named(name, "loads")
        spot = chains.spot(place, "loads")
        for own in forces:
            at = point if own.point is None else own.point
            if spot is None:
                on_platform.append(DeadForce(own.force, at))
            else:
                chains.load(spot, at, own.force)
    carried: list[tuple[int, CarriedMass]] = []  # by chains
    masses: list[PlacedMass] = []
    for mass, place in assembly.masses:
        spot = chains.spot(place, "masses")
        if spot is None:
            masses.append(mass)
        else:
            carried.append((spot[0], chains.carried(mass, place, spot[1])))
    if np.any(gravity):
        on_platform += weight([(mass.value, mass.centre) for mass in masses], gravity)
        chains.weigh(carried, gravity)
    for name, several in given.items():
        spot = chains.spot(chains.named(name, "masses")[0], "masses")
        if spot is None:
            masses += several
        else:
            carried += [(spot[0], CarriedMass(own, Spot(after=spot[1]))) for own in several]
    held = {name: body for name, body in assembly.nodes.items() if chains.is_held(body)}
    nodes = {name: chains.spot(NamedBody(body), "loads") for name, body in held.items()}
    springs = [chains.spring(own) for own in assembly.springs]
    groups, at = chains.groups(springs, platform_point, rows)
    return LoadedAssembly(
        groups,
        on_platform,
        CarriedMasses(
            tuple(replace(own, spot=Spot(*at[c], own.spot.after)) for c, own in carried),
            tuple(masses),
        ),
        {name: None if own is None else Spot(*at[own[0]], own[1]) for name, own in nodes.items()},
    )


def weight(masses: Sequence[tuple[Any, Any]], gravity: np.ndarray) -> list[DeadForce]:
    """Of masses of one body at points, as one force at their centre; none of no mass."""
    if not masses:
        return []
    value, centre = masses[0][0], np.array(masses[0][1])
    if masses[1:]:
        value = reduce(add, (each for each, _ in masses))
        if is_zero(value):
            return []
        centre = reduce(add, (np.array(at) * each for each, at in masses)) * (1 / value)
    return [DeadForce(gravity * value, centre)]


@dataclass
class _Chains:
    """The chains of an assembly, not yet in components."""

    assembly: Assembly
    of_body: Mapping[Body, Body]  # the one that stands for all that are one
    make: Elements
    ends: list[tuple[Body, Body]] = field(default_factory=list)
    elements: list[list[Element]] = field(default_factory=list)
    owners: list[Owner] = field(default_factory=list)
    loads: list[list[BodyLoad]] = field(default_factory=list)
    anchors: list[list[BodyLoad]] = field(default_factory=list)
    couplings: list[FiniteCoupling] = field(default_factory=list)
    # chain of every member, and how many elements lie before the body behind each of its parts
    behind: dict[int, tuple[int, list[int]]] = field(default_factory=dict)
    #: Chain and elements before a body: of a leg, and of any.
    at: dict[tuple[Body, int | None], tuple[int, int]] = field(default_factory=dict)

    @staticmethod
    def of(assembly: Assembly, make: Elements) -> _Chains:
        """Cut an assembly."""
        base, platform, members = assembly.base, assembly.platform, assembly.members
        bodies = (base, platform, *assembly.points, *(b for m in members for b in (m.a, m.b)))
        rigid = [(m.a, m.b) for m in members if not m.parts]
        joined = [own for own in (*assembly.joined, *rigid) if len(own) > 1]
        of_body = connected_parts(bodies, joined) if joined else {b: b for b in bodies}
        if of_body[platform] == of_body[base]:  # a rigid leg holds the platform
            of_body = {b: b for b in bodies}
        found = _Chains(assembly, of_body, make)
        pairs = {k: (of_body[m.a], of_body[m.b]) for k, m in enumerate(members)}
        pairs = {k: own for k, own in pairs.items() if own[0] != own[1]}
        for way in _ways(members, pairs, (of_body[base], of_body[platform])):
            found.add(way, pairs)
        for own in assembly.couplings:
            found.couple(own)
        return found

    def add(self, way: _Way, pairs: Mapping[int, tuple[Body, Body]]) -> None:
        """A chain of members in series."""
        number, own = len(self.elements), []
        leg = self.assembly.members[way[0][0]].leg
        name = self.assembly.legs[leg]
        body = pairs[way[0][0]][not way[0][1]]
        start = body
        for known in ((body, leg), (body, None)):
            self.at.setdefault(known, (number, 0))
        for k, forward in way:
            parts = self.assembly.members[k].parts
            counts = [len(own)]
            for part in parts if forward else parts[::-1]:
                if isinstance(part, PlacedFreedom):
                    joint = part if forward else replace(part, axis=-part.axis)
                    own.append(self.make.joint(joint, name))
                else:
                    own += self.make.spring(part, name)
                counts.append(len(own))
            self.behind[k] = number, counts if forward else counts[::-1]
            body = pairs[k][forward]
            for known in ((body, leg), (body, None)):
                if known not in self.at or body == self.of_body[self.assembly.platform]:
                    self.at[known] = number, len(own)
        self.ends.append((start, body))
        self.elements.append(own)
        self.owners.append(Owner(leg, name, min(k for k, _ in way)))
        self.loads.append([])
        self.anchors.append([])

    def element(self, place: tuple[int, int]) -> tuple[int, int]:
        """Chain, and place in it, of a joint by its member and part."""
        chain, counts = self.behind[place[0]]
        return chain, min(counts[place[1]], counts[place[1] + 1])

    def couple(self, own: SumOfJoints) -> None:
        """A coupling of joints."""
        leg = self.assembly.legs[self.assembly.members[own.follows[0]].leg]
        places = tuple(self.element(place) for place, _ in own.terms)
        factors = self.make.row([factor for _, factor in own.terms])
        drive, is_rigid = self.make.joint(own.drive, leg), own.drive.stiffness is None
        follows = self.element(own.follows)
        self.couplings.append(FiniteCoupling(drive, is_rigid, follows, places, factors))

    def push(self, preload: Mapping[str, Any]) -> None:
        """Add the preloads of joints and couplings, by their names."""
        sums = {
            own.name: i
            for i, own in enumerate(self.assembly.couplings)
            if own.drive.stiffness is not None
        }
        for name, value in preload.items():
            if name in sums:
                i = sums[name]
                self.couplings[i] = self.couplings[i].pushed(value)
                continue
            joints = self.assembly.joints
            if name not in joints and name not in self.assembly.names:
                raise unknown_name("preload", name, joints, "a joint of one coordinate")
            if name not in joints:
                raise InputError(
                    f"preload of {name!r}",
                    expected="the name of one joint that moves: passive, or with a stiffness",
                    hint="a rigid drive holds whatever it must; springs are preloaded by a drive",
                )
            chain, k = self.element(joints[name])
            joint = self.elements[chain][k]
            if isinstance(joint, FiniteJoint):
                self.elements[chain][k] = replace(joint, preload=joint.preload + value)

    def follow(self, laws: Laws) -> None:
        """Give laws of their own to joints and couplings that are not rigid, by ``leg/joint``."""
        left, known = dict(laws), []

        def under(joint: FiniteJoint, owner: Owner) -> FiniteJoint:
            known.append(f"{owner.name}/{joint.names[0]}")
            return joint.under(left.pop(known[-1])) if known[-1] in left else joint

        for i, sum_ in enumerate(self.couplings):
            if not sum_.is_rigid:
                drive = under(sum_.drive, self.owners[sum_.place[0]])
                self.couplings[i] = replace(sum_, drive=drive)
        for own, owner in zip(self.elements, self.owners, strict=True):
            own[:] = [under(e, owner) if isinstance(e, FiniteJoint) else e for e in own]
        for name in left:
            raise unknown_name("laws", name, known, "leg/joint")

    def named(self, name: str, subject: str) -> tuple[NamedBody, np.ndarray]:
        """A body by its name, and its point."""
        names = self.assembly.names
        if name not in names:
            raise unknown_name(subject, name, names, self.assembly.expected)
        return names[name]

    def is_held(self, body: Body) -> bool:
        """Whether a body is the platform, or moves and chains hold it."""
        body = self.of_body[body]
        return body != self.of_body[self.assembly.base] and (body, None) in self.at

    def spot(self, place: NamedBody, subject: str) -> tuple[int, int] | None:
        """A chain, and how many of its elements lie before a body; None of the platform itself."""
        if place.member in self.behind:
            chain, counts = self.behind[place.member]
            return chain, counts[place.parts]
        body = place.body
        if place.member is not None:
            own = self.assembly.members[place.member]
            body = own.b if place.parts else own.a
        body = self.of_body[body]
        if place.member is None and body == self.of_body[self.assembly.platform]:
            return None
        found = self.at.get((body, place.leg)) or self.at.get((body, None))
        if found is None:
            held = "a body that beams, springs or joints hold"
            raise InputError(subject, got=body, expected=held)
        return found

    def load(self, spot: tuple[int, int], point: Any, force: Any) -> None:
        """Add a force at a point of a body."""
        own = BodyLoad(spot[1], self.make.row(point), self.make.row(force))
        self.loads[spot[0]].append(own)

    def carried(self, mass: PlacedMass, place: NamedBody, after: int) -> CarriedMass:
        """A mass; one along an elastic part is carried by the bodies at its ends."""
        if mass.start is not None and place.parts and place.member in self.behind:
            part = self.assembly.members[place.member].parts[place.parts - 1]
            if isinstance(part, PlacedSpring):
                counts = self.behind[place.member][1]
                parts = counts[place.parts] - counts[place.parts - 1]
                return CarriedMass(mass, Spot(after=after), parts, part, np.asarray(part.point))
        return CarriedMass(mass, Spot(after=after))

    def weigh(self, carried: Sequence[tuple[int, CarriedMass]], gravity: np.ndarray) -> None:
        """Add weights: those of one body are one force at their centre."""
        on_bodies = defaultdict(list)
        for chain, own in carried:
            for point in own.mass.lumped(own.parts, own.end):
                after = own.spot.after - own.parts + point.after
                on_bodies[chain, after].append((point.value, point.point))
        for spot, several in on_bodies.items():
            for own in weight(several, gravity):
                self.load(spot, own.point, own.force)

    def spring(self, own: PlacedBodySpring) -> FiniteBodySpring:
        """A spring between bodies, chains by their numbers here; its anchors are added to them.

        Raises
        ------
        InputError
            When it names no body.
        """
        ends = []
        for name, at in zip(own.bodies, own.points, strict=True):
            point = self.make.row(at)
            names, spot = self.assembly.names, None
            if name in names:
                spot = self.spot(names[name][0], "springs")
            elif name not in (BASE, PLATFORM):
                known = f"{BASE}, {PLATFORM} or leg/part"
                raise unknown_name(f"body of spring {own.name!r}", name, names, known)
            if spot is None:
                ends.append(Anchor(point[0], None if name == BASE else TO_PLATFORM))
            else:
                chain, after = spot
                ends.append(Anchor(point[0], chain, len(self.anchors[chain])))
                self.anchors[chain].append(BodyLoad(after, point, 0 * point))
        return FiniteBodySpring.placed(own, (ends[0], ends[1]))

    def groups(
        self, springs: Sequence[FiniteBodySpring], point: np.ndarray, rows: tuple[int, ...]
    ) -> tuple[tuple[LegGroup, ...], list[tuple[int, int, int]]]:
        """Groups of equal components; group, row, and number there of every chain."""
        base, platform = (self.of_body[b] for b in (self.assembly.base, self.assembly.platform))
        each = ([end.chain for end in own.ends] for own in springs)
        held = [[c for c in own if c not in (None, TO_PLATFORM)] for own in each]
        coupled = [[c for c, _ in (own.place, *own.terms)] for own in self.couplings]
        meeting: list[Sequence[Hashable]] = [*held, *coupled]
        for c, ends in enumerate(self.ends):
            meeting.append([c, *((b,) for b in ends if b not in (base, platform))])
        nodes = [*range(len(self.ends)), *((b,) for ends in self.ends for b in ends)]
        first = connected_parts(nodes, meeting)
        components: dict[Hashable, list[int]] = defaultdict(list)
        for c in range(len(self.ends)):
            components[first[c]].append(c)
        alike: dict[Hashable, list[LegGroup]] = {}
        at = [(0, 0, 0)] * len(self.ends)
        for key, own in components.items():
            pairs = zip(springs, held, strict=True)
            mine = [s for s, chains in pairs if chains and first[chains[0]] == key]
            sums = [s for s in self.couplings if first[s.place[0]] == key]
            one = self.component(own, mine, sums, point, rows)
            is_alone = mine or not self.make.side_by_side
            kind: Hashable = own[0] if is_alone else one.signature
            alike.setdefault(kind, []).append(one)
            for i, c in enumerate(own):
                at[c] = list(alike).index(kind), len(alike[kind]) - 1, i
        found = [LegGroup.stacked(own) for own in alike.values()]
        alone = [own for own, chains in zip(springs, held, strict=True) if not chains]
        if alone:
            found.append(self.component([], alone, [], point, rows))
        return tuple(found), at

    def component(
        self,
        chains: Sequence[int],
        springs: Sequence[FiniteBodySpring],
        couplings: Sequence[FiniteCoupling],
        point: np.ndarray,
        rows: tuple[int, ...],
    ) -> LegGroup:
        """Chains that meet in bodies as a group of one."""
        base, platform = (self.of_body[b] for b in (self.assembly.base, self.assembly.platform))
        ends = [self.ends[c] for c in chains]
        inner = dict.fromkeys(b for own in ends for b in own if b not in (base, platform))
        on_platform = any(end.chain == TO_PLATFORM for own in springs for end in own.ends)
        if on_platform or any(start == platform for start, _ in ends):
            inner[platform] = None
        if any(end == base for _, end in ends):
            inner[base] = None
        numbers: dict[Body, int | None] = {body: i for i, body in enumerate(inner)}
        starts, stops = {**numbers, base: None}, {**numbers, platform: None}
        found = [
            FiniteChain(
                starts[start],
                stops[end],
                tuple(self.elements[c]),
                tuple(self.loads[c]),
                tuple(self.anchors[c]),
                (self.owners[c],),
            )
            for c, (start, end) in zip(chains, ends, strict=True)
        ]
        local = {c: i for i, c in enumerate(chains)}
        springs = [own.renumbered(local) for own in springs]
        springs, anchors = held_on_platform(springs, len(found))
        if platform in inner:
            own = [self.owners[c] for c in chains if self.ends[c][0] == platform]
            owner = own[0] if own else NOBODY
            last = FiniteChain(numbers[platform], None, (), (), anchors, (owner,))
            found.append(last)
        if base in inner:
            own = next(c for c in chains if self.ends[c][1] == base)
            found.append(FiniteChain(None, numbers[base], (), owners=(self.owners[own],)))
        return LegGroup(
            tuple(found),
            tuple(self.make.row(self.assembly.points.get(body, point)) for body in inner),
            point,
            rows,
            tuple(springs),
            tuple(own.renumbered(local) for own in couplings),
        )


def _ways(
    members: Sequence[Member], pairs: Mapping[int, tuple[Body, Body]], held: tuple[Body, Body]
) -> list[_Way]:
    """Members in series, cut where elastic parts change their direction, and before they close.

    Pairs are the bodies of the members, `held` the base and the platform.
    """
    legs: dict[Body, set[int]] = defaultdict(set)
    for k, ends in pairs.items():
        for body in ends:
            legs[body].add(members[k].leg)
    shared = [body for body, own in legs.items() if len(own) > 1 and body not in held]
    springs = {k for k in pairs if any(isinstance(p, PlacedSpring) for p in members[k].parts)}
    numbers = list(pairs)

    def leading(way: _Way) -> set[bool]:
        return {forward for k, forward in way if k in springs}

    found = []
    for start, _, path in branches(list(pairs.values()), [*held, *shared]):
        own: _Way = []
        body = start
        for i, forward in path:
            step = numbers[i], forward
            body = pairs[step[0]][forward]
            if own and (body == start or len(leading([*own, step])) > 1):
                found.append(own)
                own = []
            own.append(step)
        found.append(own)
    turned = []
    for way in found:
        (first, ahead), (last, forward) = way[0], way[-1]
        against = pairs[first][not ahead] == held[1] or pairs[last][forward] == held[0]
        if leading(way) == {False} or (against and not leading(way)):
            turned.append([(k, not forward) for k, forward in reversed(way)])
        else:
            turned.append(way)
    return sorted(turned, key=lambda way: min(k for k, _ in way))
