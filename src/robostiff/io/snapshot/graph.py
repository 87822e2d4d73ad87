"""Snapshot files in their graph form, read and written: bodies, and what is between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.io.document import Document, DocumentPlace
from robostiff.io.snapshot.elements import (
    BeamData,
    CouplingPart,
    FileHead,
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
    drive_data,
    head_data,
    mass_data,
    one_pose,
    refuse_twins,
    screw_data,
    spring6_data,
)
from robostiff.io.suggest import distinct, free_names
from robostiff.io.validation import validate
from robostiff.model import PlacedMass
from robostiff.network import BeamElement, JointElement, Network, Node, SpringElement
from robostiff.network.elements import CouplingElement, Element
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

    def element(self, name: str, place: DocumentPlace, _: Space) -> BeamElement:
        """The beam in the world."""
        spring, start = self.placed(name, place), np.array(self.start, dtype=float)
        properties = start, spring.point, spring.rotation, spring.elasticity.compliance
        return BeamElement(name, self.a, self.b, *properties, self.placed_masses(name))


class SpringBetween(BetweenPart, Spring6Data):
    """An elastic part given by its 6 x 6 matrix, of node b against node a."""

    masses: list[MassData] = Field(
        default=[], description="along it; without a start on the body of node b"
    )

    def element(self, name: str, place: DocumentPlace, _: Space) -> SpringElement:
        """The spring in the world, with its masses."""
        placed = self.placed(name, place)
        masses = [
            mass
            for i, entry in enumerate(self.masses)
            for mass in entry.placed(place.at("masses", i), name, placed.point)
        ]
        properties = placed.point, placed.rotation, placed.elasticity
        return SpringElement(name, self.a, self.b, *properties, tuple(masses))


class FreedomPart(ScrewData):
    """An elementary motion of a joint."""

    k: Positive | None = Field(
        description="the stiffness, N m/rad for R and H, N/m for P; null for a passive motion"
    )
    inertia: Positive | None = Field(None, description="of the drive, kg m^2 for R and H, kg for P")


class JointBetween(BetweenPart):
    """A joint between two nodes: all motions that are not listed are rigid."""

    dofs: list[FreedomPart] = Field(description="its motions; none for a weld")

    def element(self, name: str, place: DocumentPlace, space: Space) -> JointElement:
        """The joint in the world, whose motions stay in the plane of a planar network."""
        freedoms = []
        for i, dof in enumerate(self.dofs):
            freedoms.append(dof.placed(f"dof{i + 1}", place.at("dofs", i)))
            with place.at("dofs", i, "axis").complaints():
                check_fits(JointElement(name, self.a, self.b, (freedoms[-1],)), space)
        return JointElement(name, self.a, self.b, tuple(freedoms))


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
    """
    file = validate(NetworkFile, document)
    graph, place = file.graph, DocumentPlace(document).at("graph")
    shared = file.shared

    def check_known(name: str, here: DocumentPlace) -> None:
        if name not in graph.nodes:
            raise here.unknown("node", name, graph.nodes, what="one of the nodes:")

    for i, name in enumerate(graph.fixed):
        check_known(name, place.at("fixed", i))
    check_known(graph.platform, place.at("platform"))
    if graph.platform in graph.fixed:
        expected = "a node that is not fixed"
        raise place.at("platform").error("platform", got=graph.platform, expected=expected)
    for i, entry in enumerate(graph.masses):
        here = place.at("masses", i)
        check_known(entry.on, here.at("on"))
        if entry.start is not None:
            expected = "a place: at, and no start"
            raise here.at("start").error("mass of a node", got=entry.start, expected=expected)

    def built(kind: str) -> list[Any]:
        parts = getattr(graph, f"{kind}s")
        written_names, elements = [part.name for part in parts], []
        refuse_twins(written_names, place.at(f"{kind}s"), kind)
        for i, name in enumerate(free_names(written_names, [kind] * len(parts))):
            part, here = parts[i], place.at(f"{kind}s", i)
            check_known(part.a, here.at("a"))
            check_known(part.b, here.at("b"))
            if part.a == part.b:
                raise here.at("b").error("node b", got=part.b, expected="a node other than a")
            elements.append(part.element(name, here, shared["space"]))
            with here.complaints():
                check_fits(elements[-1], shared["space"])
        return elements

    beams, springs, joints = map(built, ("beam", "spring", "joint"))
    couplings = _couplings(graph, joints, place)
    if not any(map(_is_elastic, (*beams, *springs, *joints, *couplings))):
        expected = "at least one beam, spring or joint motion with a stiffness k"
        hint = "rigid parts and passive joints alone have no stiffness matrix"
        raise place.error(f"network {file.name} without compliance", expected=expected, hint=hint)
    nodes = []
    for name, coordinates in graph.nodes.items():
        point = np.array(coordinates, dtype=float)
        masses: list[PlacedMass] = []
        for i, entry in enumerate(graph.masses):
            if entry.on == name:
                masses += entry.placed(place.at("masses", i), name, point)
        nodes.append(Node(name, point, tuple(masses)))
    return Network(
        nodes=tuple(nodes),
        fixed=tuple(graph.fixed),
        platform=graph.platform,
        beams=tuple(beams),
        springs=tuple(springs),
        joints=tuple(joints),
        couplings=couplings,
        **shared,
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
    couplings = []
    for i, coupling in enumerate(graph.couplings):
        for name, factor in coupling.sum.items():
            at = place.at("couplings", i, "sum", name)
            if name not in known:
                raise at.unknown("motion of a joint", name, known)
            if len(known[name]) > 1:
                raise at.error("motion of a joint", got=name, expected="a name of one motion")
            if factor == 0:
                raise at.error("factor", got=factor, expected="a number other than zero")
        terms = tuple((*known[name][0], float(factor)) for name, factor in coupling.sum.items())
        couplings.append(CouplingElement(coupling.name or f"coupling{i + 1}", terms, coupling.k))
    return tuple(couplings)


def network_to_data(network: Network) -> dict[str, Any]:
    """Plain data that `robostiff.load` reads back, once written as JSON.

    Every beam and spring becomes a spring with its stiffness, or with its compliance if that is
    singular.

    Parameters
    ----------
    network : Network

    Raises
    ------
    InputError
        When a spring has directions both free and rigid, or nothing is elastic.
    """
    if not any(_is_elastic(element) for element in (*network.elements, *network.couplings)):
        raise InputError(
            f"network {network.name} without compliance",
            expected="at least one beam, spring or joint with a stiffness",
        )
    joints = _named(
        {
            **{"name": joint.name, "a": joint.a, "b": joint.b},
            "dofs": [{**screw_data(freedom), **drive_data(freedom)} for freedom in joint.moving],
        }
        for joint in network.joints
    )
    data = head_data(network, "network")
    springs = []
    for element in (*network.beams, *network.springs):
        spring = {key: getattr(element, key) for key in ("name", "a", "b")}
        spring |= spring6_data(element.name, *_elastic(element))
        masses = [mass_data(mass) for mass in element.masses]
        springs.append({**spring, "masses": masses} if masses else spring)
    data["graph"] = {
        "nodes": {node.name: one_pose(node.point, 1) for node in network.nodes},
        "fixed": list(network.fixed),
        "platform": network.platform,
        "springs": _named(springs),
        "joints": joints,
    }
    names = {id(joint): entry["name"] for joint, entry in zip(network.joints, joints, strict=True)}
    for element in network.couplings:
        terms = {
            f"{names[id(joint)]}/dof{place + 1}": float(factor)
            for joint, number, factor in element.terms
            if (place := joint.place(number)) is not None
        }
        if element.terms:
            coupling = {"name": element.name, "sum": terms, "k": element.stiffness}
            data["graph"].setdefault("couplings", []).append(coupling)
    masses = [
        {"on": node.name, **mass_data(mass)} for node in network.nodes for mass in node.masses
    ]
    if masses:
        data["graph"]["masses"] = masses
    return data


def _elastic(element: BeamElement | SpringElement) -> tuple[np.ndarray, np.ndarray, Elasticity]:
    if isinstance(element, BeamElement):
        return element.end, element.rotation, Elasticity(element.tip_compliance)
    return element.point, element.rotation, element.elasticity


def _named(entries: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    parts = list(entries)
    names = distinct(part["name"] for part in parts)
    return [{**part, "name": name} for part, name in zip(parts, names, strict=True)]


def _is_elastic(element: Element | CouplingElement) -> bool:
    if isinstance(element, CouplingElement):
        return element.stiffness is not None
    if isinstance(element, JointElement):
        return any(f.stiffness is not None for f in element.freedoms)
    return bool(np.any(_elastic(element)[2].compliance))
