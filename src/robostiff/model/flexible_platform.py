"""A flexible platform: nodes, and beams, springs and rigid members between them."""

from __future__ import annotations

import numpy as np

from robostiff.elasticity import BeamTheory, CrossSection, Elasticity, Material
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model.batched import BatchedPart
from robostiff.model.checks import check_distinct, vector3
from robostiff.model.link import beam_link
from robostiff.model.mass import Mass, PlacedMass
from robostiff.spatial.formula import is_formula, vanishes

_SAME_PLACE = 1e-9  # of the size of the platform


@frozen
class PlatformNode:
    """A small rigid body of the platform.

    Attributes
    ----------
    name : str
    at : (3,) array
        Where it is in the platform frame [m].
    """

    name: str
    at: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", vector3(f"node {self.name!r} of the platform", self.at))


@frozen
class PlatformPart:
    """A connection of two nodes: a beam, a spring, or a rigid member."""

    name: str
    a: str  #: name of a node
    b: str  #: and of the other
    #: (3,): about which its elasticity is given, in the platform frame [m]; of a beam its end at b
    point: np.ndarray
    axes: np.ndarray  #: (3, 3): columns are its own axes in the platform frame
    elasticity: Elasticity  #: of node b against node a; without compliance for a rigid member
    masses: tuple[Mass, ...] = ()  #: spread evenly from node a to node b


@frozen
class FlexiblePlatform:
    """Nodes that hold the legs and the tool, and the elastic parts between them.

    The pose is that of the tool; where the nodes are while nothing bends follows from it.

    Attributes
    ----------
    nodes : tuple of PlatformNode
    parts : tuple of PlatformPart
    tool : str
        The node that carries the reference point.

    Raises
    ------
    InputError
        Two nodes or parts of one name, a name that no node has, a part from a node to itself, or a
        node that nothing connects with the tool.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> hub, rim = PlatformNode("hub", np.zeros(3)), PlatformNode("rim", np.array([0.2, 0, 0]))
    >>> arm = platform_beam(hub, rim, material("steel"), circle(0.02), name="arm")
    >>> FlexiblePlatform((hub, rim), (arm,), tool="hub").node_of(None, np.array([0.2, 0, 0]))
    'rim'
    """

    nodes: tuple[PlatformNode, ...]
    parts: tuple[PlatformPart, ...]
    tool: str

    def __post_init__(self) -> None:
        names = [node.name for node in self.nodes]
        check_distinct("names of the nodes of the platform", names)
        check_distinct("names of the parts of the platform", [part.name for part in self.parts])
        for subject, name in [("tool", self.tool)] + [
            (f"node of {part.name!r}", name) for part in self.parts for name in (part.a, part.b)
        ]:
            if name not in names:
                expected = f"a node: {', '.join(names)}"
                raise InputError(f"{subject} of the platform", got=name, expected=expected)
        for part in self.parts:
            if part.a == part.b:
                raise InputError(
                    f"nodes of {part.name!r} of the platform",
                    got=part.a,
                    expected="two different nodes",
                )
        connected, size = {self.tool}, 0  # by a chain of parts
        while len(connected) > size:
            size = len(connected)
            for part in self.parts:
                if part.a in connected or part.b in connected:
                    connected |= {part.a, part.b}
        loose = [name for name in names if name not in connected]
        if loose or not self.parts:
            raise InputError(
                "nodes of the platform",
                got=Words(f"{', '.join(loose) or self.tool} without connection to the others"),
                expected=f"beams, springs or rigid members from every node to {self.tool!r}",
            )

    def point_of(self, name: str) -> np.ndarray:
        """Point of a node in the platform frame (3,) [m]."""
        return next(node.at for node in self.nodes if node.name == name)

    def node_of(self, name: str | None, point: np.ndarray) -> str:
        """The node that holds a leg: that of the name, or where none is given the one at a point.

        The point (3,) is in the platform frame [m]. Raises InputError when there is none, or more
        than one.
        """
        if name is not None:
            names = [node.name for node in self.nodes]
            if name not in names:
                subject = "node that holds the leg"
                raise InputError(subject, got=name, expected=f"a node: {', '.join(names)}")
            return name
        numbers = [np.abs(node.at).max() for node in self.nodes if node.at.dtype != object]
        allowed = _SAME_PLACE * max(numbers, default=0.0)
        nodes, places = [], []
        for node in self.nodes:
            gap = node.at - point
            if vanishes(gap) if gap.dtype == object else np.abs(gap).max() <= allowed:
                nodes.append(node.name)
            at = (str(x) if is_formula(x) else f"{x:.6g}" for x in node.at)
            places.append(f"{node.name} at [{', '.join(at)}]")
        if len(nodes) != 1:
            raise InputError(
                "end of the leg on a flexible platform",
                got=point,
                expected=f"the place of one node: {', '.join(places)}",
                hint="name the node that holds the leg",
            )
        return nodes[0]


def platform_beam(
    a: PlatformNode,
    b: PlatformNode,
    material: Material,
    section: CrossSection,
    *,
    y_axis: np.ndarray | None = None,
    theory: BeamTheory | None = None,
    name: str = "beam",
) -> PlatformPart:
    """Straight beam between two nodes of a platform.

    Raises
    ------
    InputError
        When the nodes are in one place, or the section needs a `y_axis` and has none.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> a, b = PlatformNode("a", np.zeros(3)), PlatformNode("b", np.array([0.2, 0, 0]))
    >>> platform_beam(a, b, material("steel"), circle(0.02)).point
    array([0.2, 0. , 0. ])
    """
    to = b.at - a.at
    if not np.any(to):
        raise InputError(
            f"beam {name!r} of the platform",
            got=Words(f"nodes {a.name!r} and {b.name!r} at one place"),
            expected="nodes at different places",
        )
    link = beam_link(to, material, section, y_axis=y_axis, theory=theory, name=name)
    return PlatformPart(name, a.name, b.name, b.at, link.axes, link.elasticity, link.masses)


def rigid_member(a: PlatformNode, b: PlatformNode, name: str = "rigid") -> PlatformPart:
    """Rigid member between two nodes of a platform."""
    return PlatformPart(name, a.name, b.name, b.at, np.eye(3), Elasticity(np.zeros((6, 6))))


@frozen
class PlacedPlatform(BatchedPart):
    """A flexible platform in the world."""

    platform: FlexiblePlatform
    holds: tuple[str, ...]  #: the node that holds each leg
    rotation: np.ndarray  #: (..., 3, 3): columns are the axes of the platform frame
    origin: np.ndarray  #: (..., 3): of that frame [m]

    @property
    def masses(self) -> dict[str, tuple[PlacedMass, ...]]:
        """Those of its parts in the world at one pose, by the names of the parts."""
        found: dict[str, tuple[PlacedMass, ...]] = {}
        for part in self.platform.parts:
            a, b = (self.in_world(self.platform.point_of(node)) for node in (part.a, part.b))
            along = 0.5 * (a + b), 0, a, (0.0, 1.0)
            found[part.name] = tuple(PlacedMass(part.name, m.value, *along) for m in part.masses)
        return found

    def in_world(self, point: np.ndarray) -> np.ndarray:
        """A point of the platform frame (3,) in the world (..., 3) [m]."""
        return self.origin + np.einsum("...ij,j->...i", self.rotation, point)
