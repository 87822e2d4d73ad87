"""A network: rigid bodies connected in any way by elements; a robot of legs as one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model import (
    CoupledFreedom,
    PlacedBlock,
    PlacedFreedom,
    PlacedLeg,
    PlacedMass,
    PlacedPlatform,
    PlacedSpring,
    Snapshot,
)
from robostiff.model.checks import check_distinct
from robostiff.model.subject import FrozenSubject
from robostiff.network.elements import (
    BeamElement,
    CouplingElement,
    Element,
    JointElement,
    Node,
    NodeForce,
    SpringElement,
    weights_on_ends,
)
from robostiff.spatial import Space

_ROUNDING = 1e-12  # of a coordinate: closer points are one


@frozen
class Network(FrozenSubject):
    """Rigid bodies and elements between them, at one pose in world coordinates.

    Attributes
    ----------
    name : str
    nodes : tuple of Node
    fixed : tuple of str
        Names of the nodes that do not move.
    platform : str
        Name of the node whose stiffness is computed.
    reference_point : (3,) array
        Point of the platform about which stiffness is given [m].
    beams : tuple of BeamElement
    springs : tuple of SpringElement
    joints : tuple of JointElement
    space : Space
    description : str
    couplings : tuple of CouplingElement
        Of its joints.
    gravity : (3,) array or None
        Acceleration of free fall, as the network has it [m/s^2].

    Raises
    ------
    InputError
        Two nodes of one name; an element or a list that names a node that is not there; an element
        from a node to itself; a platform that is fixed; nothing that is fixed.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,)).free_nodes
    ('tip',)
    """

    kind: ClassVar[str] = "network"
    name: str
    nodes: tuple[Node, ...]
    fixed: tuple[str, ...]
    platform: str
    reference_point: np.ndarray
    beams: tuple[BeamElement, ...] = ()
    springs: tuple[SpringElement, ...] = ()
    joints: tuple[JointElement, ...] = ()
    space: Space = Space.SPATIAL
    description: str = ""
    couplings: tuple[CouplingElement, ...] = ()
    gravity: np.ndarray | None = None

    def __post_init__(self) -> None:
        names = [node.name for node in self.nodes]
        check_distinct("names of the nodes", names)
        known = set(names)
        _check_known("fixed node", self.fixed, known)
        _check_known("platform", (self.platform,), known)
        for element in self.elements:
            if not (element.a in known and element.b in known):
                _check_known(f"node of {element.name!r}", (element.a, element.b), known)
            if element.a == element.b:
                raise InputError(
                    f"nodes of {element.name!r}", got=element.a, expected="two different nodes"
                )
        if not self.fixed:
            raise InputError("fixed nodes", got=Words("none"), expected="at least one")
        if self.platform in self.fixed:
            raise InputError("platform", got=self.platform, expected="a node that is not fixed")

    def __repr__(self) -> str:
        counts = f"{len(self.nodes)} nodes, {len(self.beams)} beams, {len(self.springs)} springs"
        return f"<Network {self.name!r}, {counts}, {len(self.joints)} joints>"

    @property
    def elements(self) -> Iterator[Element]:
        """Beams, springs and joints, in this order."""
        yield from self.beams
        yield from self.springs
        yield from self.joints

    @property
    def named_masses(self) -> Iterator[tuple[str, PlacedMass]]:
        """All masses, by the names of the nodes and parts that have them."""
        for own in (*self.nodes, *self.beams, *self.springs):
            yield from ((own.name, mass) for mass in own.masses)

    def moving_masses(self, nodes: Container[str]) -> Iterator[PlacedMass]:
        """Masses of given nodes, and of the elements that move with them."""
        for node in self.nodes:
            yield from node.masses if node.name in nodes else ()
        for element in (*self.beams, *self.springs):
            for mass in element.masses:
                ends = (element.b,) if mass.start is None else (element.a, element.b)
                if any(end in nodes for end in ends):
                    yield mass

    def weights(self, gravity: np.ndarray) -> Iterator[NodeForce]:
        """Weights under a gravity (3,) [m/s^2]; elastic parts put theirs on their ends.

        Uniform and tapered beams have then the deflection under their weight exactly at their ends.
        """
        for node in self.nodes:
            yield from (NodeForce(node.name, m.value * gravity, m.centre) for m in node.masses)
        for element in (*self.beams, *self.springs):
            yield from weights_on_ends(element, gravity)

    @cached_property
    def free_nodes(self) -> tuple[str, ...]:
        """Names of the nodes that may move."""
        fixed = set(self.fixed)
        return tuple(node.name for node in self.nodes if node.name not in fixed)

    @cached_property
    def attachments(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of nodes (k,), and points (k, 3) at which elements are attached to them [m].

        Slides have no definite point.
        """
        places: list[tuple[str, np.ndarray]] = []
        for beam in self.beams:
            places += (beam.a, beam.start), (beam.b, beam.end)
        for spring in self.springs:
            places += (spring.a, spring.point), (spring.b, spring.point)
        for joint in self.joints:
            at = [own.point for own in joint.freedoms if own.turns]
            places += ((node, point) for point in at for node in (joint.a, joint.b))
        number = {node.name: i for i, node in enumerate(self.nodes)}
        numbers = np.array([number[name] for name, _ in places], dtype=int)
        return numbers, np.array([point for _, point in places], dtype=float).reshape(-1, 3)

    @cached_property
    def characteristic_length(self) -> float:
        """Root mean square distance of all points of attachment from their mean [m].

        It depends on no point that was chosen freely, scales with the unit of length, and is 0 for
        a network that is all in one point.
        """
        _, points = self.attachments
        if not len(points):
            return 0.0
        from_first = points - points[0]
        spread = from_first - from_first.mean(axis=0)
        length = float(np.sqrt(np.mean(np.sum(spread**2, axis=1))))
        # As rounding remains of joints that meet in the origin, whatever leads there.
        places = np.vstack([points, self.reference_point, *(node.point for node in self.nodes)])
        return length if length > _ROUNDING * np.abs(places).max() else 0.0


def _check_known(what: str, names: Iterable[str], known: set[str]) -> None:
    for name in names:
        if name not in known:
            raise InputError(
                what, got=name, expected=f"the name of a node: {', '.join(sorted(known)[:12])}"
            )


_GROUND, _PLATFORM = "ground", "platform"


def network_of_snapshot(snapshot: Snapshot) -> Network:
    """A robot at one pose as a network of rigid bodies, springs and joints.

    Nothing is condensed and no leg treated apart: each element connects two bodies, and
    `condense` finds the stiffness of the platform without the forms of K_C.

    Parameters
    ----------
    snapshot : Snapshot
        At one pose.

    Raises
    ------
    InputError
        When it holds several poses, or springs of formulas.

    Examples
    --------
    >>> import robostiff as rs
    >>> posture = rs.find_posture(rs.load("hexapod"))
    >>> network = network_of_snapshot(posture.snapshot.one(0))
    >>> len(network.nodes), len(network.joints), len(network.springs)
    (56, 36, 24)
    """
    if snapshot.reference_point.ndim != 1:
        raise InputError(
            f"poses of snapshot {snapshot.name!r}",
            got=snapshot.reference_point.shape[:-1],
            expected="one pose",
            hint="take one of them: snapshot.one(0)",
        )
    parts = _Parts([Node(_GROUND, snapshot.centre), Node(_PLATFORM, snapshot.reference_point)])
    if snapshot.platform is not None:
        placed, platform = snapshot.platform, snapshot.platform.platform
        parts.nodes += [
            Node(platform_node(placed, node.name), placed.in_world(node.at))
            for node in platform.nodes
            if node.name != platform.tool
        ]
        for part in platform.parts:
            ends = platform_node(placed, part.a), platform_node(placed, part.b)
            place = placed.in_world(part.point), placed.rotation @ part.axes, part.elasticity
            name = f"{_PLATFORM}/{part.name}"
            parts.springs.append(SpringElement(name, *ends, *place, placed.masses[part.name]))
    for number, leg in enumerate(snapshot.legs):
        end = _PLATFORM
        if snapshot.platform is not None:
            end = platform_node(snapshot.platform, snapshot.platform.holds[number])
        _add_chain(leg, f"{number + 1} {leg.name}", leg.name, (_GROUND, end), parts)
    parts.masses[_PLATFORM] += snapshot.masses
    return Network(
        snapshot.name,
        tuple(replace(node, masses=tuple(parts.masses[node.name])) for node in parts.nodes),
        (_GROUND,),
        _PLATFORM,
        snapshot.reference_point,
        springs=tuple(parts.springs),
        joints=tuple(parts.joints),
        couplings=tuple(parts.couplings),
        space=snapshot.space,
        description=snapshot.description,
        gravity=snapshot.gravity,
    )


@dataclass
class _Parts:
    """Nodes and elements of a network while it is built."""

    nodes: list[Node]
    springs: list[SpringElement] = field(default_factory=list)
    joints: list[JointElement] = field(default_factory=list)
    couplings: list[CouplingElement] = field(default_factory=list)
    masses: dict[str, list[PlacedMass]] = field(default_factory=lambda: defaultdict(list))


def _add_chain(
    leg: PlacedLeg, prefix: str, name: str, ends: tuple[str, str], parts: _Parts
) -> None:
    """A leg or a branch between two bodies, with one more body after every element but the last."""
    before, last = ends
    alone = [e.alone if isinstance(e, CoupledFreedom) else e for e in leg.elements]
    elements = [
        (k, own)
        for k, own in enumerate(alone, start=1)
        if not isinstance(own, PlacedFreedom) or own.is_passive or own.stiffness is not None
    ]
    joints: dict[str, JointElement] = {}
    bodies = [(0, before)]
    for i, (k, element) in enumerate(elements):
        if i == len(elements) - 1:
            after = last
        else:
            after = f"{prefix}, after {i + 1} {element.name}"
            is_block = isinstance(element, PlacedBlock)
            point = element.branches[0].end if is_block else element.point
            parts.nodes.append(Node(after, np.asarray(point, dtype=float)))
        own = f"{name}/{element.name}"
        if isinstance(element, PlacedBlock):
            for j, branch in enumerate(element.branches):
                own_prefix = f"{prefix}, {i + 1} {element.name}, {j + 1} {branch.name}"
                _add_chain(branch, own_prefix, f"{own}/{branch.name}", (before, after), parts)
        elif isinstance(element, PlacedSpring):
            masses = tuple(
                replace(m, after=0) for m in leg.masses if m.start is not None and m.after == k
            )
            place = element.point, element.rotation, element.elasticity
            parts.springs.append(SpringElement(own, before, after, *place, masses))
        else:
            joints[element.name] = JointElement(name, before, after, (element,))
            parts.joints.append(joints[element.name])
        before = after
        bodies.append((k, after))
    for mass in leg.masses:
        if mass.start is None:
            carrier = next(body for k, body in reversed(bodies) if k <= mass.after)
            parts.masses[carrier].append(replace(mass, after=0))
    for one in leg.elements:
        if isinstance(one, CoupledFreedom) and len(one.sum) > 1:
            # A joint that a rigid drive holds is no joint of the network, and does not turn.
            terms = tuple((joints[own], 0, a) for own, a in one.sum if own in joints)
            parts.couplings.append(CouplingElement(f"{name}/{one.name}", terms, one.stiffness))
    if not elements:
        parts.joints.append(JointElement(name, *ends))


def platform_node(placed: PlacedPlatform, name: str) -> str:
    """Name in the network of a node of a flexible platform; its tool is the platform."""
    return _PLATFORM if name == placed.platform.tool else f"{_PLATFORM}, {name}"
