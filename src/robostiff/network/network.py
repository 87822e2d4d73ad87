"""A network: rigid bodies connected in any way by beams, springs and joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robostiff.errors import InputError
from robostiff.network.elements import (
    BeamElement,
    CouplingElement,
    Element,
    JointElement,
    Node,
    NodeForce,
    SpringElement,
)
from robostiff.spatial import Space

_ROUNDING = 1e-12  # of a coordinate: closer points are one


@dataclass(frozen=True)
class Network:
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
        for name, count in Counter(names).items():
            if count > 1:
                raise InputError("name of the node", got=name, expected="a name no other node has")
        known = set(names)
        _check_known("fixed node", self.fixed, known)
        _check_known("platform", (self.platform,), known)
        for element in self.elements:
            _check_known(f"node of {element.name!r}", (element.a, element.b), known)
            if element.a == element.b:
                raise InputError(
                    f"nodes of {element.name!r}", got=element.a, expected="two different nodes"
                )
        if not self.fixed:
            raise InputError("fixed nodes", got="none", expected="at least one")
        if self.platform in self.fixed:
            raise InputError("platform", got=self.platform, expected="a node that is not fixed")

    @property
    def elements(self) -> Iterator[Element]:
        """Beams, springs and joints, in this order."""
        yield from self.beams
        yield from self.springs
        yield from self.joints

    @property
    def has_masses(self) -> bool:
        """Whether a body or an elastic part has a mass."""
        return any(own.masses for own in (*self.nodes, *self.beams, *self.springs))

    def weights(self, gravity: np.ndarray) -> Iterator[NodeForce]:
        """Weights under a gravity (3,) [m/s^2]; elastic parts put theirs on their ends.

        A uniform beam has then the deflection under its weight exactly at its ends.
        """
        for node in self.nodes:
            yield from (NodeForce(node.name, m.value * gravity, m.centre) for m in node.masses)
        for element in (*self.beams, *self.springs):
            end = element.end if isinstance(element, BeamElement) else element.point
            for mass in element.masses:
                for own in mass.lumped(1, end):
                    node = element.b if own.after or mass.start is None else element.a
                    yield NodeForce(node, own.value * gravity, own.point)

    def check_has_no_couplings(self, subject: str) -> None:
        """Raise an InputError if joints are coupled, in a question that does not take them."""
        if self.couplings:
            raise InputError(
                f"{subject} of {self.name!r}",
                got=f"coupled joints: {', '.join(repr(own.name) for own in self.couplings)}",
                expected="joints that move by themselves, in this question",
            )

    @cached_property
    def free_nodes(self) -> tuple[str, ...]:
        """Names of the nodes that may move."""
        fixed = set(self.fixed)
        return tuple(node.name for node in self.nodes if node.name not in fixed)

    @cached_property
    def connection_points(self) -> dict[str, list[np.ndarray]]:
        """Attachment points of each node [m], without slides, which have no definite point."""
        points: dict[str, list[np.ndarray]] = {node.name: [] for node in self.nodes}
        for beam in self.beams:
            points[beam.a].append(beam.start)
            points[beam.b].append(beam.end)
        for spring in self.springs:
            points[spring.a].append(spring.point)
            points[spring.b].append(spring.point)
        for joint in self.joints:
            for freedom in joint.freedoms:
                if freedom.turns:
                    points[joint.a].append(freedom.point)
                    points[joint.b].append(freedom.point)
        return points

    @cached_property
    def characteristic_length(self) -> float:
        """Root mean square distance of all points of attachment from their mean [m].

        It depends on no point that was chosen freely, scales with the unit of length, and is 0 for
        a network that is all in one point.
        """
        points = [point for attached in self.connection_points.values() for point in attached]
        if not points:
            return 0.0
        from_first = np.array(points) - points[0]
        spread = from_first - from_first.mean(axis=0)
        length = float(np.sqrt(np.mean(np.sum(spread**2, axis=1))))
        return length if length > _ROUNDING * np.abs(points).max() else 0.0


def _check_known(what: str, names: Iterable[str], known: set[str]) -> None:
    for name in names:
        if name not in known:
            raise InputError(
                what, got=name, expected=f"the name of a node: {', '.join(sorted(known)[:12])}"
            )
