"""A network: rigid bodies connected in any way by elements; a robot of legs as one."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from functools import cached_property
from typing import ClassVar

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model import PlacedMass
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
                subject = f"nodes of {element.name!r}"
                raise InputError(subject, got=element.a, expected="two different nodes")
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
            expected = f"the name of a node: {', '.join(sorted(known)[:12])}"
            raise InputError(what, got=name, expected=expected)
