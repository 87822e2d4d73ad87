"""Bodies and elements in any arrangement, ready to be loaded: networks, and linkages at a pose.

Beams, springs and joints in series are one chain, from a body at which the network branches to the
next; rigid connections make one body of two. Elastic parts lead from their first node to their
second, so that a series of which some lead the other way is several chains. Loops need no tree:
each chain closes by itself. Chains begin at the base and end at the platform: where one begins at
the platform, or ends at the base, is a body between chains, and an empty chain holds both together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.kinematics.spanning_tree import branches, connected_parts
from robostiff.model import Locked, PlacedFreedom, PlacedMass, PlacedSpring
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.network.elements import CouplingElement
from robostiff.network.elements import Element as NetworkElement
from robostiff.statics.chains.beam_bowing import Beams, SpringElements, is_rigid, moves
from robostiff.statics.chains.carried_masses import CarriedMass, CarriedMasses
from robostiff.statics.chains.chain import BodyLoad, Element, FiniteChain, FiniteCoupling
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.loading.from_snapshot import finite_joint
from robostiff.statics.loading.given_loads import DeadForce, load_vector, weights_of

#: Elements in series by their numbers, each with whether it is passed from its first node.
_Way = list[tuple[int, bool]]
#: Chain, and place in it, of a freedom: by the name of its joint, its nodes, and its own name.
_Places = dict[tuple[str, str, str, str], tuple[int, int]]


def group_of(
    network: Network,
    platform_point: np.ndarray,
    beams: Beams,
    loads: Mapping[str, Sequence[DeadForce]],
    preload: Mapping[str, float],
    gravity: np.ndarray,
    given: Mapping[str, Sequence[PlacedMass]],
) -> tuple[LegGroup, list[DeadForce], CarriedMasses]:
    """A network as one leg from its fixed bodies to its platform; forces on the latter; masses.

    Forces act on bodies, preloads [N or N m] in joints, by their names. Gravity [m/s^2] makes
    weights of the masses of the network, not of the `given` ones. Wrenches are about a point of the
    platform (3,) [m].

    Raises
    ------
    InputError
        When a load is on no body that moves, or a preload at no joint of one coordinate.
    """
    bodies = _Bodies.of(network)
    forces, masses = bodies.loaded(loads), bodies.masses
    for body, own in masses.items():
        forces[body] += weights_of(own, gravity)
    for name, more in given.items():
        masses[bodies.moving(name, "masses")] += more
    elements = SpringElements(network.space, beams)
    chains: list[FiniteChain] = []
    carried: list[CarriedMass] = []
    left = dict(preload)
    places: _Places = {}
    at: dict[str, tuple[int, int]] = {}  # chain, and how many elements lie before the body
    for way in bodies.chains:
        number, along = len(chains), bodies.along(way)
        own, before, lengthwise = _in_series(bodies, way, number, elements, left, places)
        for body, after in zip(along, before, strict=True):
            at.setdefault(body, (number, after))
        weights = [load for one in lengthwise if np.any(gravity) for load in one.weights(gravity)]
        carried += lengthwise
        ends = bodies.start(along[0]), bodies.end(along[-1])
        chains.append(FiniteChain(*ends, tuple(own), tuple(weights)))
    still = {network.platform, bodies.base}
    for body in [own for own in {**forces, **masses} if own not in still]:
        if not (forces[body] or masses[body]):
            continue
        if body not in at:
            raise InputError(
                "loads" if forces[body] else "masses",
                got=body,
                expected="a body that beams, springs or joints hold",
            )
        number, after = at[body]
        pairs = [np.array([[f.point], [f.force]], dtype=float) for f in forces[body]]
        on_body = (BodyLoad(after, point, force) for point, force in pairs)
        own = chains[number]
        chains[number] = replace(own, loads=(*own.loads, *on_body))
        carried += [CarriedMass(mass, number, after) for mass in masses[body]]
    chains += [  # empty ones to base and platform as bodies between chains
        FiniteChain(bodies.start(own), None, ())
        if own == network.platform
        else FiniteChain(None, bodies.end(own), ())
        for own in bodies.twice
    ]
    couplings = [
        coupled.pushed(0.0 if coupled.is_rigid else left.pop(one.name, 0.0))
        for one in network.couplings
        for coupled in _coupled(one, places)
    ]
    for name in left:
        raise InputError("preload", got=name, expected="a joint of one coordinate that moves")
    moving = {name: own for name, own in bodies.of_node.items() if own != bodies.base}
    within = {name: at[body] for name, body in moving.items() if body in bodies.within}
    group = LegGroup(
        (0,),
        (network.name,),
        tuple(chains),
        tuple(bodies.points[name][None] for name in bodies.numbers),
        platform_point,
        network.space.rows,
        couplings=tuple(couplings),
        nodes={name: bodies.end(body) for name, body in moving.items() if name not in within},
        within=within,
    )
    on_platform = forces.get(network.platform, [])
    return group, on_platform, CarriedMasses(tuple(carried), tuple(masses[network.platform]))


def _in_series(
    bodies: _Bodies,
    way: _Way,
    number: int,
    elements: SpringElements,
    preload: dict[str, float],
    places: _Places,
) -> tuple[list[Element], list[int], list[CarriedMass]]:
    """Elements of a chain, how many lie before each body along it, and masses along its parts.

    Preloads that its joints take are taken out, and places of the joints put in.
    """
    own: list[Element] = []
    before, lengthwise = [0], []
    for k, forward in way:
        element, parts = bodies.elements[k], _parts(bodies.elements[k])
        for part in parts[:: 1 if forward else -1]:
            if isinstance(part, PlacedFreedom):
                places[element.name, element.a, element.b, part.name] = number, len(own)
                joint = finite_joint(part if forward else replace(part, axis=-part.axis))
                push = preload.pop(part.name, 0.0)
                own.append(replace(joint, preload=joint.preload + push))
            else:
                own += elements.of(part)
        if not isinstance(element, JointElement) and isinstance(part := parts[0], PlacedSpring):
            here = number, len(own), len(own) - before[-1], part, np.asarray(part.point)
            lengthwise += [CarriedMass(m, *here) for m in element.masses if m.start is not None]
        before.append(len(own))
    return own, before, lengthwise


@dataclass(frozen=True)
class _Bodies:
    """Which nodes are one body, and the elements in series between them.

    For each node `of_node` has the one that stands for its body: the base, the platform, or any.
    Points are those of all nodes [m].
    """

    network: Network
    of_node: Mapping[str, str]
    points: Mapping[str, np.ndarray]

    @staticmethod
    def of(network: Network) -> _Bodies:
        base = network.fixed[0]
        rigid = [(e.a, e.b) for e in network.elements if all(map(is_rigid, _parts(e)))]
        names = (base, network.platform, *(node.name for node in network.nodes))
        own = connected_parts(names, [network.fixed, *rigid])
        if own[network.platform] == base:
            raise InputError(
                f"platform of {network.name!r}",
                got="one that rigid parts hold",
                expected="one that moves against the fixed bodies",
            )
        points = {node.name: np.asarray(node.point, dtype=float) for node in network.nodes}
        return _Bodies(network, own, points)

    @property
    def base(self) -> str:
        """The body of the fixed nodes."""
        return self.network.fixed[0]

    @cached_property
    def elements(self) -> tuple[NetworkElement, ...]:
        """Beams, springs and joints."""
        return tuple(self.network.elements)

    @cached_property
    def ends(self) -> dict[int, tuple[str, str]]:
        """Bodies of the elements that move, by their numbers."""
        each = ((self.of_node[e.a], self.of_node[e.b]) for e in self.elements)
        return {k: (a, b) for k, (a, b) in enumerate(each) if a != b}

    @cached_property
    def paths(self) -> list[_Way]:
        """Elements in series between bodies at which the network branches."""
        numbers, held = list(self.ends), (self.base, self.network.platform)
        each = branches(list(self.ends.values()), held)
        return [[(numbers[i], forward) for i, forward in path] for _, _, path in each]

    @cached_property
    def chains(self) -> list[_Way]:
        """The paths, cut where elastic parts change their direction, and before they close."""
        found: list[_Way] = []
        for path in self.paths:
            start, *behind = self.along(path)
            own: _Way = []
            for step, body in zip(path, behind, strict=True):
                if own and (body == start or len(self._leading([*own, step])) > 1):
                    found.append(own)
                    own = []
                own.append(step)
            found.append(own)
        return [
            [(k, not forward) for k, forward in reversed(own)]
            if self._leading(own) == {False}
            else own
            for own in found
        ]

    def _leading(self, way: _Way) -> set[bool]:
        """Directions in which elastic parts of a way are passed."""
        return {forward for k, forward in way if not isinstance(self.elements[k], JointElement)}

    @property
    def masses(self) -> defaultdict[str, list[PlacedMass]]:
        """Masses by the bodies that carry them, without those along elastic parts that move."""
        found: defaultdict[str, list[PlacedMass]] = defaultdict(list)
        for node in self.network.nodes:
            found[self.of_node[node.name]] += node.masses
        for k, element in enumerate(self.elements):
            if not isinstance(element, JointElement):
                own = [m for m in element.masses if k not in self.ends or m.start is None]
                found[self.of_node[element.b]] += own
        return found

    def along(self, way: _Way) -> list[str]:
        """The body at the start of elements in series, and those behind each."""
        number, forward = way[0]
        start = self.ends[number][not forward]
        return [start, *(self.ends[k][ahead] for k, ahead in way)]

    @cached_property
    def within(self) -> frozenset[str]:
        """Bodies that chains pass through."""
        return frozenset(body for way in self.chains for body in self.along(way)[1:-1])

    @cached_property
    def between(self) -> tuple[str, ...]:
        """Bodies between chains, but base and platform."""
        others = self.within | {self.base, self.network.platform}
        return tuple(own for own in dict.fromkeys(self.of_node.values()) if own not in others)

    @cached_property
    def twice(self) -> tuple[str, ...]:
        """Base and platform where they are between chains, too."""
        each = [self.along(way) for way in self.chains]
        platform = any(own[0] == self.network.platform for own in each)
        base = any(own[-1] == self.base for own in each)
        return (*[self.network.platform] * platform, *[self.base] * base)

    def loaded(self, loads: Mapping[str, Sequence[DeadForce]]) -> dict[str, list[DeadForce]]:
        """Forces at points, by bodies that move."""
        found: dict[str, list[DeadForce]] = defaultdict(list)
        for name, forces in loads.items():
            body = self.moving(name, "loads")
            for own in forces:
                at = self.points[name] if own.point is None else own.point
                force = load_vector("force", name, own.force)
                found[body].append(DeadForce(force, load_vector("point", name, at)))
        return found

    def moving(self, name: str, subject: str) -> str:
        """The body that a node is part of, one that moves."""
        body = self.of_node.get(name)
        if body in (None, self.base):
            others = [own for own in dict.fromkeys(self.of_node.values()) if own != self.base]
            moving = ", ".join([own for own in others if own != self.network.platform][:5])
            raise InputError(
                subject, got=name, expected=f"the name of a body that moves, or platform: {moving}"
            )
        return body

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Places of the bodies between chains, those that are base and platform the last."""
        return {body: i for i, body in enumerate((*self.between, *self.twice))}

    def start(self, body: str) -> int | None:
        """Number of a body at which a chain begins; None for the base."""
        return None if body == self.base else self.numbers[body]

    def end(self, body: str) -> int | None:
        """Number of a body at which a chain ends; None for the platform."""
        return None if body == self.network.platform else self.numbers[body]


def _parts(element: NetworkElement) -> list[PlacedSpring | PlacedFreedom]:
    """An element as parts of a chain from its first node to its second."""
    if isinstance(element, BeamElement):
        elasticity = Elasticity(element.tip_compliance)
        return [PlacedSpring(element.name, element.end, element.rotation, elasticity)]
    if isinstance(element, SpringElement):
        return [PlacedSpring(element.name, element.point, element.rotation, element.elasticity)]
    return [
        replace(freedom, name=_name(element, i))
        for i, freedom in enumerate(element.freedoms)
        if moves(freedom)
    ]


def _name(joint: JointElement, i: int) -> str:
    return f"{joint.name}[{i}]" if len(joint.freedoms) > 1 else joint.name


def _coupled(one: CouplingElement, places: _Places) -> list[FiniteCoupling]:
    """A coupling of joints at places; none where none of them moves."""
    keys = [(joint.name, joint.a, joint.b, _name(joint, i)) for joint, i, _ in one.terms]
    moving = [(key, term) for key, term in zip(keys, one.terms, strict=True) if key in places]
    if not moving:
        return []
    first, (joint, i, _) = moving[0]
    freedom = replace(joint.freedoms[i], name=one.name, role=Locked(one.stiffness), coordinate=None)
    return [
        FiniteCoupling(
            finite_joint(freedom),
            one.stiffness is None,
            places[first],
            tuple(places[key] for key, _ in moving),
            np.array([[factor for _, (_, _, factor) in moving]], dtype=float),
        )
    ]
