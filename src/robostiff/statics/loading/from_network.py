"""Bodies and elements in any arrangement, ready to be loaded: networks, and linkages at a pose.

Every body but base and platform is one between chains, and every beam, spring or joint a chain of
its own, from its first node to its second, whichever of them the platform is; rigid connections
make one body of two. Loops need no tree: each chain closes by itself. Chains begin at the base and
end at the platform: a part that begins at the platform, or ends at the base, has a body between
chains there, and an empty chain holds both together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.kinematics.spanning_tree import branches
from robostiff.model import Locked, PlacedFreedom, PlacedMass, PlacedSpring
from robostiff.model.snapshot import PlacedElement
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.network.elements import CouplingElement
from robostiff.network.elements import Element as NetworkElement
from robostiff.statics.chains.beam_bowing import Beams, SpringElements, is_rigid, moves
from robostiff.statics.chains.carried_masses import CarriedMass, CarriedMasses
from robostiff.statics.chains.chain import Element, FiniteChain, FiniteCoupling
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.loading.flexible_platform import held_together
from robostiff.statics.loading.from_snapshot import finite_joint
from robostiff.statics.loading.given_loads import DeadForce, load_vector, weights_of


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
    on_bodies = bodies.loaded(loads)
    masses: dict[str, list[PlacedMass]] = defaultdict(list)
    for node in network.nodes:
        masses[bodies.of_node[node.name]] += node.masses
    elements = SpringElements(network.space, beams)
    chains: list[FiniteChain] = []
    carried: list[CarriedMass] = []
    left = dict(preload)
    places: dict[tuple[str, str, str, str], tuple[int, int]] = {}
    for number, element in enumerate(network.elements):
        a, b = bodies.of_node[element.a], bodies.of_node[element.b]
        of_part = () if isinstance(element, JointElement) else element.masses
        along = [m for m in of_part if a != b and m.start is not None]
        masses[b] += [m for m in of_part if a == b or m.start is None]
        if a == b:
            continue
        parts = _parts(element)
        own: list[Element] = []
        for part in parts:
            if isinstance(part, PlacedFreedom):
                places[element.name, element.a, element.b, part.name] = len(chains), len(own)
                joint = finite_joint(part)
                push = left.pop(part.name, 0.0)
                own.append(replace(joint, preload=joint.preload + push))
            else:
                own += elements.of(part, bodies.sides[number])
        end = np.asarray(element.end if isinstance(element, BeamElement) else element.point)
        part = parts[0] if isinstance(parts[0], PlacedSpring) else None
        place = len(chains), len(own), len(own), part, end
        of_chain = [CarriedMass(m, *place) for m in along]
        weights = [load for one in of_chain if np.any(gravity) for load in one.weights(gravity)]
        carried += of_chain
        start, end = bodies.start(a), bodies.end(b)
        chains.append(FiniteChain(start, end, tuple(own), tuple(weights)))
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
    for body, of_body in masses.items():
        on_bodies[body] += weights_of(of_body, gravity)
    for name, more in given.items():
        masses[bodies.moving(name, "masses")] += more
    on_platform = on_bodies.pop(network.platform, [])
    group = LegGroup(
        (0,),
        (network.name,),
        tuple(chains),
        tuple(bodies.points[name][None] for name in (*bodies.between, *bodies.twice)),
        platform_point,
        network.space.rows,
        couplings=tuple(couplings),
        nodes={
            name: bodies.number(body)
            for name, body in bodies.of_node.items()
            if body != bodies.of_node[network.fixed[0]]
        },
    )
    group, on_others = _with_bodies(group, bodies, on_bodies, masses)
    carried += on_others
    return group, on_platform, CarriedMasses(tuple(carried), tuple(masses[network.platform]))


@dataclass(frozen=True)
class _Bodies:
    """Which nodes are one body.

    For each node `of_node` has the one that stands for its body: a fixed one, the platform, or any;
    `between` are those that are neither, `twice` base and platform where they are between chains,
    too. Points are those of all nodes [m].
    """

    network: Network
    of_node: Mapping[str, str]
    between: tuple[str, ...]
    twice: tuple[str, ...]
    points: Mapping[str, np.ndarray]

    @staticmethod
    def of(network: Network) -> _Bodies:
        base = network.fixed[0]
        alone = {n.name: base if n.name in network.fixed else n.name for n in network.nodes}
        rigid = [(e.a, e.b) for e in network.elements if all(map(is_rigid, _parts(e)))]
        own = held_together(alone, rigid, (base, network.platform))
        if own[network.platform] == base:
            raise InputError(
                f"platform of {network.name!r}",
                got="one that rigid parts hold",
                expected="one that moves against the fixed bodies",
            )
        bodies = tuple(n for n in dict.fromkeys(own.values()) if n not in (base, network.platform))
        points = {node.name: np.asarray(node.point, dtype=float) for node in network.nodes}
        ends = [(own[e.a], own[e.b]) for e in network.elements if own[e.a] != own[e.b]]
        twice = [network.platform] if any(a == network.platform for a, _ in ends) else []
        twice += [base] if any(b == base for _, b in ends) else []
        return _Bodies(network, own, bodies, tuple(twice), points)

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
        if body is None or body == self.of_node[self.network.fixed[0]]:
            raise InputError(
                subject,
                got=name,
                expected="the name of a body that moves, or platform: "
                + ", ".join(self.between[:5]),
            )
        return body

    @cached_property
    def sides(self) -> Mapping[int, Sequence[Sequence[PlacedElement]]]:
        """Parts in series before and beyond each element, by its number, outwards from it.

        They end at bodies that others hold, too. Elements within one body have none.
        """
        ends = [(self.of_node[e.a], self.of_node[e.b]) for e in self.network.elements]
        parts = [_parts(e) for e in self.network.elements]
        moving = [k for k, (a, b) in enumerate(ends) if a != b]
        found: dict[int, Sequence[Sequence[PlacedElement]]] = {k: ([], []) for k in moving}
        held = self.network.fixed[0], self.network.platform
        for _, _, path in branches([ends[k] for k in moving], held):
            way = [parts[moving[i]][:: 1 if forward else -1] for i, forward in path]
            for place, (i, forward) in enumerate(path):
                before = list(chain.from_iterable(way[:place]))[::-1]
                beyond = list(chain.from_iterable(way[place + 1 :]))
                found[moving[i]] = (before, beyond) if forward else (beyond, before)
        return found

    def number(self, body: str) -> int | None:
        """Of a body between chains; None for base and platform."""
        return self.between.index(body) if body in self.between else None

    def start(self, body: str) -> int | None:
        """Number of a body at which a chain begins; None for the base."""
        return self._twice(body) if body == self.network.platform else self.number(body)

    def end(self, body: str) -> int | None:
        """Number of a body at which a chain ends; None for the platform."""
        return self.number(body) if body not in self.network.fixed else self._twice(body)

    def _twice(self, body: str) -> int:
        return len(self.between) + self.twice.index(body)


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


def _coupled(
    one: CouplingElement, places: Mapping[tuple[str, str, str, str], tuple[int, int]]
) -> list[FiniteCoupling]:
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


def _with_bodies(
    group: LegGroup,
    bodies: _Bodies,
    forces: Mapping[str, Sequence[DeadForce]],
    masses: Mapping[str, Sequence[PlacedMass]],
) -> tuple[LegGroup, list[CarriedMass]]:
    """A network with forces on bodies between its chains, and the masses of these."""
    carried = []
    for i, body in enumerate(bodies.between):
        own = forces.get(body, ())
        try:
            if own:
                points = [np.asarray(f.point, dtype=float) for f in own]
                vectors = [np.asarray(f.force, dtype=float) for f in own]
                group = group.with_forces(i, points, vectors)
            for mass in masses.get(body, ()):
                _, chain, after = group.held_at(i)
                carried.append(CarriedMass(mass, chain, after))
        except LookupError:
            raise InputError(
                "loads" if own else "masses",
                got=body,
                expected="a body that beams, springs or joints hold",
            ) from None
    return group, carried
