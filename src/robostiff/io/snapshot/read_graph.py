"""Snapshot files in their graph form: rigid bodies, and beams, springs and joints between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robostiff.io.document import Document, DocumentPlace
from robostiff.io.snapshot.elements import (
    BeamData,
    FilePart,
    Informative,
    MassData,
    Name,
    NodeMass,
    Number,
    Point,
    Positive,
    ScrewData,
    Spring6Data,
)
from robostiff.io.snapshot.read import CouplingPart, FileHead, refuse_twins
from robostiff.io.suggest import numbered
from robostiff.io.validation import validate
from robostiff.model import Actuated, Passive, PlacedMass
from robostiff.network import BeamElement, JointElement, Network, Node, SpringElement
from robostiff.network.elements import CouplingElement
from robostiff.network.equations import check_fits
from robostiff.spatial import Space


class BetweenPart(FilePart):
    """Common keys of elements between two nodes."""

    name: Name | None = Field(
        None, description="unique among its kind; by default the kind and a number"
    )
    a: Name = Field(description="the node at its start")
    b: Name = Field(description="the node at its end")
    note: Informative = None


class BeamBetween(BetweenPart, BeamData):
    """A straight flexible link of constant cross-section, rigidly attached to two nodes."""


class SpringBetween(BetweenPart, Spring6Data):
    """An elastic part given by its 6 x 6 matrix, of node b against node a."""

    masses: list[MassData] = Field(
        default=[], description="along it; without a start on the body of node b"
    )


class FreedomPart(ScrewData):
    """An elementary motion of a joint."""

    k: Positive | None = Field(
        description="the stiffness, N m/rad for R and H, N/m for P; null for a passive motion"
    )
    inertia: Positive | None = Field(None, description="of the drive, kg m^2 for R and H, kg for P")


class JointBetween(BetweenPart):
    """A joint between two nodes: all motions that are not listed are rigid."""

    dofs: list[FreedomPart] = Field(description="its motions; none for a weld")


class GraphCoupling(CouplingPart):
    """A gear or differential between joints anywhere."""

    sum: Annotated[dict[Name, Number], Field(min_length=1)] = Field(
        description="joints with their factors; ``joint/dof2`` for the second motion of a joint"
    )


class GraphPart(FilePart):
    """Rigid bodies and what is between them."""

    nodes: Annotated[dict[Name, Point], Field(min_length=2)] = Field(
        description="the rigid bodies by name, each with a point of its own [m]"
    )
    fixed: list[Name] = Field(min_length=1, description="the nodes that do not move")
    platform: Name = Field(description="the node whose stiffness is computed")
    beams: list[BeamBetween] = Field(default=[], description="beams between nodes")
    springs: list[SpringBetween] = Field(default=[], description="springs between nodes")
    joints: list[JointBetween] = Field(default=[], description="joints between nodes")
    couplings: list[GraphCoupling] = Field(default=[], description="of joints")
    masses: list[NodeMass] = Field(default=[], description="masses of nodes")
    note: Informative = None


class NetworkFile(FileHead):
    """A network frozen at a pose: world axes, metres, newtons and radians."""

    graph: GraphPart = Field(description="the bodies and what is between them")


def network_from_document(document: Document) -> Network:
    """A network, from a document.

    Raises a FileError at the place in the document that is to blame.

    Examples
    --------
    >>> from robostiff.io.document import parse_document
    >>> text = '''
    ... name: sliding table
    ... reference_point: [0, 0, 0]
    ... graph:
    ...   nodes: {bed: [0, 0, 0], table: [0, 0, 0.1]}
    ...   fixed: [bed]
    ...   platform: table
    ...   joints:
    ...     - {a: bed, b: table, dofs: [{kind: P, point: [0, 0, 0], axis: [1, 0, 0], k: 2.0e+6}]}
    ... '''
    >>> network_from_document(parse_document(text)).joints[0].name
    'joint1'
    """
    file = validate(NetworkFile, document)
    graph, place = file.graph, DocumentPlace(document).at("graph")
    _check_nodes(graph, place)
    space = Space.PLANAR if file.planar else Space.SPATIAL

    def built(kind: str, make: Callable[..., Any]) -> list[Any]:
        here, parts = place.at(f"{kind}s"), getattr(graph, f"{kind}s")
        given = [part.name for part in parts]
        refuse_twins(given, here, kind)
        names = numbered(given, [kind] * len(parts))
        return [make(part, names[i], here.at(i), space) for i, part in enumerate(parts)]

    beams, springs = built("beam", _beam), built("spring", _spring)
    joints: list[JointElement] = built("joint", _joint)
    couplings = _couplings(graph, joints, place)
    elastic = beams or springs or any(f.stiffness for j in joints for f in j.freedoms)
    elastic = elastic or any(own.stiffness for own in couplings)
    if not elastic:
        raise place.error(
            f"network {file.name} without compliance",
            expected="at least one beam, spring or joint motion with a stiffness k",
            hint="rigid parts and passive joints alone have no stiffness matrix",
        )
    nodes = []
    for name, given in graph.nodes.items():
        point = np.array(given, dtype=float)
        masses: list[PlacedMass] = []
        for i, own in enumerate(graph.masses):
            if own.on == name:
                masses += own.placed(place.at("masses", i), name, point)
        nodes.append(Node(name, point, tuple(masses)))
    return Network(
        file.name,
        tuple(nodes),
        tuple(graph.fixed),
        graph.platform,
        np.array(file.reference_point, dtype=float),
        tuple(beams),
        tuple(springs),
        tuple(joints),
        space,
        file.description,
        couplings=couplings,
        gravity=None if file.gravity is None else np.array(file.gravity, dtype=float),
    )


def _couplings(
    graph: GraphPart, joints: Sequence[JointElement], place: DocumentPlace
) -> tuple[CouplingElement, ...]:
    """Held sums of the coordinates of joints."""
    known: dict[str, list[tuple[JointElement, int]]] = defaultdict(list)
    for joint in joints:
        for i in range(len(joint.freedoms)):
            known[f"{joint.name}/dof{i + 1}"].append((joint, i))
        if len(joint.freedoms) == 1:
            known[joint.name].append((joint, 0))
    found = []
    for i, own in enumerate(graph.couplings):
        for name, factor in own.sum.items():
            there = place.at("couplings", i, "sum", name)
            if name not in known:
                raise there.unknown("motion of a joint", name, known)
            if len(known[name]) > 1:
                raise there.error("motion of a joint", got=name, expected="a name of one motion")
            if factor == 0:
                raise there.error("factor", got=factor, expected="a number other than zero")
        terms = tuple((*known[name][0], float(factor)) for name, factor in own.sum.items())
        found.append(CouplingElement(own.name or f"coupling{i + 1}", terms, own.k))
    return tuple(found)


def _check_nodes(graph: GraphPart, place: DocumentPlace) -> None:
    for i, name in enumerate(graph.fixed):
        _check_known(name, graph, place.at("fixed", i))
    _check_known(graph.platform, graph, place.at("platform"))
    if graph.platform in graph.fixed:
        raise place.at("platform").error(
            "platform", got=graph.platform, expected="a node that is not fixed"
        )
    for i, own in enumerate(graph.masses):
        _check_known(own.on, graph, place.at("masses", i, "on"))
        if own.start is not None:
            raise place.at("masses", i, "start").error(
                "mass of a node", got=own.start, expected="a place: at, and no start"
            )
    for key in ("beams", "springs", "joints"):
        for i, part in enumerate(getattr(graph, key)):
            _check_known(part.a, graph, place.at(key, i, "a"))
            _check_known(part.b, graph, place.at(key, i, "b"))
            if part.a == part.b:
                raise place.at(key, i, "b").error(
                    "node b", got=part.b, expected="a node other than a"
                )


def _check_known(name: str, graph: GraphPart, place: DocumentPlace) -> None:
    if name not in graph.nodes:
        raise place.unknown("node", name, graph.nodes, what="one of the nodes:")


def _beam(part: BeamBetween, name: str, place: DocumentPlace, space: Space) -> BeamElement:
    spring = part.placed(name, place)
    start = np.array(part.start, dtype=float)
    compliance = spring.elasticity.compliance
    ends = start, spring.point
    masses = part.placed_masses(name)
    beam = BeamElement(name, part.a, part.b, *ends, spring.rotation, compliance, masses)
    with place.complaints():
        check_fits(beam, space)
    return beam


def _spring(part: SpringBetween, name: str, place: DocumentPlace, space: Space) -> SpringElement:
    placed = part.placed(name, place)
    masses: list[PlacedMass] = []
    for i, own in enumerate(part.masses):
        masses += own.placed(place.at("masses", i), name, placed.point)
    own = placed.point, placed.rotation, placed.elasticity
    spring = SpringElement(name, part.a, part.b, *own, tuple(masses))
    with place.complaints():
        check_fits(spring, space)
    return spring


def _joint(part: JointBetween, name: str, place: DocumentPlace, space: Space) -> JointElement:
    freedoms = []
    for i, freedom in enumerate(part.dofs):
        role = Passive() if freedom.k is None else Actuated(freedom.k, inertia=freedom.inertia)
        freedoms.append(freedom.placed(f"dof{i + 1}", place.at("dofs", i), role))
        with place.at("dofs", i, "axis").complaints():
            check_fits(JointElement(name, part.a, part.b, (freedoms[-1],)), space)
    return JointElement(name, part.a, part.b, tuple(freedoms))
