"""Legs from the bodies and members of an assembly, with what acts on them.

Members in series are one chain, from a body at which the assembly branches to the next. Elastic
parts lead from their first body to their second, so that a series of which some lead the other way
is several chains. Loops need no tree: each chain closes by itself. Chains begin at the base and end
at the platform: where one begins at the platform, or ends at the base, is a body between chains,
and an empty chain holds both together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.frozen import frozen
from robostiff.kinematics.spanning_tree import branches, connected_parts
from robostiff.model import PlacedBodySpring, PlacedFreedom, PlacedMass, PlacedSpring
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.network.assembly import Assembly, Body, Member, NamedBody, SumOfJoints, unknown_name
from robostiff.record import is_zero
from robostiff.statics.chains.beam_bowing import Elements
from robostiff.statics.chains.elements import (
    NOBODY,
    ON_PLATFORM,
    BodyLoad,
    Element,
    FiniteBodySpring,
    FiniteChain,
    FiniteCoupling,
    FiniteJoint,
    FiniteSpring,
    Owner,
    Spot,
)
from robostiff.statics.chains.legs import Legs
from robostiff.statics.equations.vibration import CarriedMass, CarriedMasses
from robostiff.statics.loading.given_loads import DeadForce, Laws

#: Members in series by their numbers, each with whether it is passed from its first body.
_Way = list[tuple[int, bool]]


@frozen
class LoadedAssembly:
    """Legs; forces on the platform; masses; where the bodies are that results list."""

    legs: Legs
    on_platform: list[DeadForce]
    masses: CarriedMasses
    nodes: Mapping[str, Spot | None]  # None of the platform


def loaded_legs(
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
    if laws:
        chains.follow(laws)
    on_platform: list[DeadForce] = []
    for name, forces in loads.items():
        place, point = assembly.body_of_name(name, "loads")
        spot = chains.spot(place, "loads")
        for load in forces:
            at = point if load.point is None else load.point
            if spot is None:
                on_platform.append(DeadForce(load.force, at))
            else:
                chains.load(spot, at, load.force)
    carried: list[CarriedMass] = []
    masses: list[PlacedMass] = []
    for mass, place in assembly.masses:
        spot = chains.spot(place, "masses")
        if spot is None:
            masses.append(mass)
        else:
            carried.append(chains.carried(mass, place, spot))
    if np.any(gravity):
        on_platform += weight([(mass.value, mass.centre) for mass in masses], gravity)
        chains.weigh(carried, gravity)
    for name, several in given.items():
        spot = chains.spot(assembly.body_of_name(name, "masses")[0], "masses")
        if spot is None:
            masses += several
        else:
            carried += [CarriedMass(m, spot) for m in several]
    held = chains.at.keys() - {(chains.of_body[assembly.base], None)}  # bodies that move
    bodies = {name: b for name, b in assembly.nodes.items() if (chains.of_body[b], None) in held}
    nodes = {name: chains.spot(NamedBody(body), "loads") for name, body in bodies.items()}
    springs = [chains.spring(spring) for spring in assembly.springs]
    legs = chains.legs(springs, platform_point, rows)
    return LoadedAssembly(legs, on_platform, CarriedMasses(tuple(carried), tuple(masses)), nodes)


def weight(masses: Sequence[tuple[Any, Any]], gravity: np.ndarray) -> list[DeadForce]:
    """Of masses of one body at points, as one force at their centre; none of no mass."""
    if not masses:
        return []
    value, centre = masses[0][0], np.array(masses[0][1])
    if masses[1:]:
        value = reduce(add, (m for m, _ in masses))
        if is_zero(value):
            return []
        centre = reduce(add, (np.array(at) * m for m, at in masses)) * (1 / value)
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
        of_body = connected_parts(bodies, rigid) if rigid else {b: b for b in bodies}
        if of_body[platform] == of_body[base]:  # a rigid leg holds the platform
            of_body = {b: b for b in bodies}
        found = _Chains(assembly, of_body, make)
        pairs = {k: (of_body[m.a], of_body[m.b]) for k, m in enumerate(members)}
        pairs = {k: pair for k, pair in pairs.items() if pair[0] != pair[1]}
        for way in _ways(members, pairs, (of_body[base], of_body[platform])):
            found.add(way, pairs)
        for coupling in assembly.couplings:
            found.couple(coupling)
        return found

    def add(self, way: _Way, pairs: Mapping[int, tuple[Body, Body]]) -> None:
        """A chain of members in series."""
        number, elements = len(self.elements), []
        leg = self.assembly.members[way[0][0]].leg
        name = self.assembly.legs[leg]
        body = pairs[way[0][0]][not way[0][1]]
        start = body
        for known in ((body, leg), (body, None)):
            self.at.setdefault(known, (number, 0))
        for k, forward in way:
            parts = self.assembly.members[k].parts
            counts = [len(elements)]
            for part in parts if forward else parts[::-1]:
                if isinstance(part, PlacedFreedom):
                    joint = self.make.joint(part if forward else replace(part, axis=-part.axis))
                    elements.append(joint if forward else replace(joint, is_passed_back=True))
                else:
                    elements += self.make.spring(part, name)
                counts.append(len(elements))
            self.behind[k] = number, counts if forward else counts[::-1]
            body = pairs[k][forward]
            for known in ((body, leg), (body, None)):
                if known not in self.at or body == self.of_body[self.assembly.platform]:
                    self.at[known] = number, len(elements)
        self.ends.append((start, body))
        self.elements.append(elements)
        self.owners.append(Owner(leg, name, min(k for k, _ in way)))
        self.loads.append([])

    def element(self, place: tuple[int, int]) -> tuple[int, int]:
        """Chain, and place in it, of a joint by its member and part."""
        chain, counts = self.behind[place[0]]
        return chain, min(counts[place[1]], counts[place[1] + 1])

    def couple(self, coupling: SumOfJoints) -> None:
        """A coupling of joints."""
        places = tuple(self.element(place) for place, _ in coupling.terms)
        factors = self.make.array([factor for _, factor in coupling.terms])
        drive, is_rigid = self.make.joint(coupling.drive), coupling.drive.stiffness is None
        follows = self.element(coupling.follows)
        self.couplings.append(FiniteCoupling(drive, is_rigid, follows, places, factors))

    def push(self, preload: Mapping[str, Any]) -> None:
        """Add the preloads of joints and couplings, by their names."""
        sums = {
            coupling.name: i
            for i, coupling in enumerate(self.assembly.couplings)
            if coupling.drive.stiffness is not None
        }
        for name, value in preload.items():
            if name in sums:
                coupling = self.couplings[sums[name]]
                drive = replace(coupling.drive, preload=coupling.drive.preload + value)
                self.couplings[sums[name]] = replace(coupling, drive=drive)
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
        rest, known = dict(laws), []

        def under(joint: FiniteJoint, owner: Owner) -> FiniteJoint:
            known.append(f"{owner.name}/{joint.name}")
            return joint.under(rest.pop(known[-1])) if known[-1] in rest else joint

        for i, sum_ in enumerate(self.couplings):
            if not sum_.is_rigid:
                drive = under(sum_.drive, self.owners[sum_.place[0]])
                self.couplings[i] = replace(sum_, drive=drive)
        for elements, owner in zip(self.elements, self.owners, strict=True):
            elements[:] = [under(e, owner) if isinstance(e, FiniteJoint) else e for e in elements]
        for name in rest:
            raise unknown_name("laws", name, known, "leg/joint")

    def spot(self, place: NamedBody, subject: str) -> Spot | None:
        """A body in a chain; None of the platform itself."""
        if place.member in self.behind:
            chain, counts = self.behind[place.member]
            return Spot(chain, counts[place.parts])
        body = place.body
        if place.member is not None:
            member = self.assembly.members[place.member]
            body = member.b if place.parts else member.a
        body = self.of_body[body]
        if place.member is None and body == self.of_body[self.assembly.platform]:
            return None
        found = self.at.get((body, place.leg)) or self.at.get((body, None))
        if found is None:
            expected = "a body that beams, springs or joints hold"
            raise InputError(subject, got=body, expected=expected)
        return Spot(*found)

    def load(self, spot: Spot, point: Any, force: Any) -> None:
        """Add a force at a point of a body."""
        load = BodyLoad(spot.after, self.make.array(point), self.make.array(force))
        self.loads[spot.chain].append(load)

    def carried(self, mass: PlacedMass, place: NamedBody, spot: Spot) -> CarriedMass:
        """A mass; one along an elastic part is carried by the bodies at its ends."""
        if mass.start is not None and place.parts and place.member in self.behind:
            part = self.assembly.members[place.member].parts[place.parts - 1]
            if isinstance(part, PlacedSpring):
                chain, counts = self.behind[place.member]
                own = self.elements[chain][counts[place.parts - 1] : counts[place.parts]]
                cuts = 0.0, *(e.ends for e in own if isinstance(e, FiniteSpring))
                return CarriedMass(mass, spot, cuts, part, mass.end_of_part(part.point))
        return CarriedMass(mass, spot)

    def weigh(self, carried: Sequence[CarriedMass], gravity: np.ndarray) -> None:
        """Add weights: those of one body are one force at their centre."""
        on_bodies = defaultdict(list)
        for one in carried:
            for point in one.mass.lumped(one.cuts, one.end):
                spot = Spot(one.spot.chain, one.spot.after - one.parts + point.after)
                on_bodies[spot].append((point.value, point.point))
        for spot, several in on_bodies.items():
            for dead in weight(several, gravity):
                self.load(spot, dead.point, dead.force)

    def spring(self, spring: PlacedBodySpring) -> FiniteBodySpring:
        """A spring between bodies, chains by their numbers here; InputError when it names none."""
        spots: list[Spot | None] = []
        for name in spring.bodies:
            names, spot = self.assembly.names, None
            if name in names:
                spot = self.spot(names[name][0], "springs")
            elif name not in (BASE, PLATFORM):
                known = f"{BASE}, {PLATFORM} or leg/part"
                raise unknown_name(f"body of spring {spring.name!r}", name, names, known)
            spots.append(None if name == BASE else spot or ON_PLATFORM)
        return FiniteBodySpring.placed(spring, self.make.array(spring.points), (spots[0], spots[1]))

    def legs(
        self, springs: Sequence[FiniteBodySpring], point: np.ndarray, rows: tuple[int, ...]
    ) -> Legs:
        """The chains as legs.

        Where one begins at the platform or holds springs there, or ends at the base, its component
        has a body of its own that an empty chain joins with that.
        """
        base, platform = (self.of_body[b] for b in (self.assembly.base, self.assembly.platform))
        attached = [[at.chain for at in s.spots if at not in (None, ON_PLATFORM)] for s in springs]
        meeting: list[Sequence[Hashable]] = [chains for chains in attached if chains]
        meeting += [[c for c, _ in (one.place, *one.terms)] for one in self.couplings]
        for c, ends in enumerate(self.ends):
            meeting.append([c, *((b,) for b in ends if b not in (base, platform))])
        nodes = [*range(len(self.ends)), *((b,) for ends in self.ends for b in ends)]
        first = connected_parts(nodes, meeting)
        bodies: dict[tuple[Hashable, Body], int] = {}
        joined: dict[tuple[Hashable, Body], Owner] = {}  # with the platform, and with the base
        found = []
        for c, (ends, owner) in enumerate(zip(self.ends, self.owners, strict=True)):
            numbers: list[int | None] = []
            for body, beyond, usual in zip(ends, (platform, base), (base, platform), strict=True):
                key = first[c], body
                numbers.append(None if body == usual else bodies.setdefault(key, len(bodies)))
                if body == beyond:
                    joined.setdefault(key, owner)
            elements, loads = tuple(self.elements[c]), tuple(self.loads[c])
            found.append(FiniteChain(numbers[0], numbers[1], elements, loads, owner))
        last: dict[Hashable, int] = {}
        for spring, chains in zip(springs, attached, strict=True):
            key = (first[chains[0]] if chains else None), platform
            if ON_PLATFORM in spring.spots:
                bodies.setdefault(key, len(bodies))
                joined.setdefault(key, NOBODY)
        for (component, body), owner in joined.items():
            if body == base:
                found.append(FiniteChain(None, bodies[component, body], (), owner=owner))
            else:
                last[component] = len(found)
                found.append(FiniteChain(bodies[component, body], None, (), owner=owner))
        numbered = (
            s.renumbered({ON_PLATFORM.chain: last.get(first[chains[0]] if chains else None, -1)})
            for s, chains in zip(springs, attached, strict=True)
        )
        points = np.broadcast_arrays(
            *(self.assembly.points.get(body, point) for _, body in bodies), point
        )
        places = self.make.array(np.stack(points, axis=-2))[..., :-1, :]
        return Legs(tuple(found), places, point, rows, tuple(numbered), tuple(self.couplings))


def _ways(
    members: Sequence[Member], pairs: Mapping[int, tuple[Body, Body]], outer: tuple[Body, Body]
) -> list[_Way]:
    """Members in series, cut where elastic parts change their direction, and before they close.

    Pairs are the bodies of the members, `outer` the base and the platform.
    """
    legs: dict[Body, set[int]] = defaultdict(set)
    for k, ends in pairs.items():
        for body in ends:
            legs[body].add(members[k].leg)
    shared = [body for body, meeting in legs.items() if len(meeting) > 1 and body not in outer]
    springs = {k for k in pairs if any(isinstance(p, PlacedSpring) for p in members[k].parts)}
    numbers = list(pairs)

    def leading(way: _Way) -> set[bool]:
        return {forward for k, forward in way if k in springs}

    found = []
    for start, _, path in branches(list(pairs.values()), [*outer, *shared]):
        piece: _Way = []
        body = start
        for i, forward in path:
            step = numbers[i], forward
            body = pairs[step[0]][forward]
            if piece and (body == start or len(leading([*piece, step])) > 1):
                found.append(piece)
                piece = []
            piece.append(step)
        found.append(piece)
    turned = []
    for way in found:
        (first, ahead), (last, forward) = way[0], way[-1]
        start, end = pairs[first][not ahead], pairs[last][forward]
        against = end == outer[0] or start == outer[1]
        # joints between two bodies of a leg, from its base on
        inner = start != outer[0] and end != outer[1] and not any(ahead for _, ahead in way)
        turns = leading(way) == {False} or ((against or inner) and not leading(way))
        turned.append([(k, not forward) for k, forward in reversed(way)] if turns else way)
    return sorted(turned, key=lambda way: min(k for k, _ in way))
