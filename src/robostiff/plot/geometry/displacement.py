"""Motion of every body of a machine: under a small load, and from one state to another."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.analysis import Deflection
from robostiff.model import CoupledFreedom, PlacedLeg, PlacedSpring, Snapshot
from robostiff.model.snapshot import PlacedBlock
from robostiff.network import (
    JointElement,
    Network,
    SpringElement,
    motions_under,
    network_of_snapshot,
)
from robostiff.network.network import platform_node
from robostiff.spatial import cross, move_twist, move_wrench
from robostiff.statics import BodyPlace, BodyPlaces


@dataclass(frozen=True)
class BodyMotion:
    """Twist (6,) of a body: translation of the point `about` (3,), rotation [m, rad]."""

    twist: np.ndarray
    about: np.ndarray

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.twist[:3] + self.turned(point - self.about)

    def twist_about(self, point: np.ndarray) -> np.ndarray:
        """Its twist (6,) about another point (3,)."""
        return move_twist(self.twist, point - self.about)

    def turned(self, along: np.ndarray) -> np.ndarray:
        """Change of a vector (3,) that the body carries."""
        return cross(self.twist[3:], along)


Motions = Mapping[str, BodyMotion]
"""Of bodies by name; of a robot of legs ``leg/element`` is the body behind an element."""

PLATFORM = "platform"
STILL = BodyMotion(np.zeros(6), np.zeros(3))


def node_key(name: str) -> str:
    """The name of a node of a flexible platform among bodies."""
    return f"{PLATFORM}, {name}"


def end_key(snapshot: Snapshot, i: int) -> str:
    """The body that leg i ends on: the platform, or the node that holds the leg."""
    placed = snapshot.platform
    return PLATFORM if placed is None else node_key(placed.holds[i])


def motion_under(posed: Snapshot | Network, bent: Deflection) -> Motions:
    """Motions of the bodies at the single pose that was loaded, of a deflection.

    The robot is the network of its parts; a body whose place the platform does not feel is held.

    Raises
    ------
    NoAnswerError
        When there is no deflection.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("planar-link")
    >>> bent = rs.deflection(robot, wrench=[0, 10, 0])
    >>> motions = motion_under(rs.find_posture(robot).snapshot.one(0), bent)
    >>> bool(np.allclose(motions["link/tip"].twist, motions["platform"].twist))
    True
    """
    answer = bent.stiffness
    network = network_of_snapshot(posed) if isinstance(posed, Snapshot) else posed
    v = (network.reference_point - answer.reference_point)[: network.space.translations]
    F, tolerance = move_wrench(bent.wrench, v), answer.details().tolerance
    moved = motions_under(network, F, bent.forces, tolerance)
    o = answer.origin
    nodes = {n: BodyMotion(BodyMotion(*own).twist_about(o), o) for n, own in moved.items()}
    if not isinstance(posed, Snapshot):
        return nodes
    found = {PLATFORM: nodes[network.platform]}
    if posed.platform is not None:
        for node in posed.platform.platform.nodes:
            found[node_key(node.name)] = nodes[platform_node(posed.platform, node.name)]
    first = 0 if posed.platform is None else len(posed.platform.platform.parts)
    parts = iter(network.springs[first:]), iter(network.joints)
    for leg in posed.legs:
        found |= {
            f"{leg.name}/{n}": nodes[own] for n, own in _bodies(leg, network.fixed[0], *parts)
        }
    return found


def _bodies(
    leg: PlacedLeg, node: str, springs: Iterator[SpringElement], joints: Iterator[JointElement]
) -> Generator[tuple[str, str], None, str]:
    """Elements of a leg with the node behind each, and the last node.

    Springs and joints come in the order in which `network_of_snapshot` makes them.
    """
    is_welded = True
    for element in leg.elements:
        own = element.alone if isinstance(element, CoupledFreedom) else element
        if isinstance(own, PlacedBlock):
            end = node
            for branch in own.branches:
                end = yield from _bodies(branch, node, springs, joints)
            node, is_welded = end, False
        elif isinstance(own, PlacedSpring):
            node, is_welded = next(springs).b, False
        elif own.is_passive or own.stiffness is not None:
            node, is_welded = next(joints).b, False
        yield element.name, node
    return next(joints).b if is_welded else node


def spatial(values: np.ndarray, rows: Sequence[int]) -> np.ndarray:
    """A twist or a wrench (6,) of its values in some rows."""
    whole = np.zeros(6)
    whole[list(rows)] = values
    return whole


@dataclass(frozen=True)
class FiniteMotion(BodyMotion):
    """A body that turns far: X moves by ``D X + t``, and a line along it by ``D`` of it."""

    D: np.ndarray
    t: np.ndarray  # (3,): [m]

    @staticmethod
    def of(place: BodyPlace) -> FiniteMotion:
        """The displacements of a body."""
        return FiniteMotion(np.zeros(6), np.zeros(3), place.R - np.eye(3), place.t)

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.D @ point + self.t

    def turned(self, along: np.ndarray) -> np.ndarray:
        """Change of a vector (3,) that the body carries."""
        return self.D @ along


def finite_motions(posed: Any, places: BodyPlaces) -> Motions:
    """Motions of all bodies of a machine from its unloaded posture to their places."""
    found: dict[str, BodyMotion] = {PLATFORM: FiniteMotion.of(places.platform)}
    if isinstance(posed, Network):
        still = BodyPlace(np.eye(3), np.zeros(3))
        nodes = {posed.platform: places.platform, **places.nodes}
        return {one.name: FiniteMotion.of(nodes.get(one.name, still)) for one in posed.nodes}
    if not isinstance(posed, Snapshot):
        return found
    known = {name: FiniteMotion.of(own) for name, own in places.behind.items()}
    found |= {node_key(name): FiniteMotion.of(own) for name, own in places.nodes.items()}
    for i, leg in enumerate(posed.legs):
        _along(leg, f"{leg.name}/", STILL, known, found)
        # nothing moves behind the last part that does
        for element in reversed(leg.elements):
            key = f"{leg.name}/{element.name}"
            found[key] = found[end_key(posed, i)]
            if isinstance(element, PlacedBlock) or key in known:
                break
    return found


def _along(
    leg: PlacedLeg, prefix: str, body: BodyMotion, known: Motions, found: dict[str, BodyMotion]
) -> BodyMotion:
    """Find the bodies of a leg from its first; the last one."""
    for element in leg.elements:
        if isinstance(element, PlacedBlock):
            ends = [_along(own, prefix, body, known, found) for own in element.branches]
            body = ends[0]
        body = found[prefix + element.name] = known.get(prefix + element.name, body)
    return body
