"""Motion of every body of a machine: under a small load, and from one state to another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robostiff.analysis import Deflection
from robostiff.frozen import frozen
from robostiff.model import PlacedLeg, Snapshot
from robostiff.model.snapshot import PlacedBlock
from robostiff.network import Network, network_under_loads
from robostiff.network.assembly import network_of_legs
from robostiff.spatial import move_wrench, skew
from robostiff.statics import BodyPlaces


@frozen
class BodyMotion:
    """A motion by which a point X of a body moves by ``D X + t``, small or far."""

    D: np.ndarray  #: (3, 3): ``R - 1`` for a rotation R, and its first order for a small one
    t: np.ndarray  #: (3,): displacement of the origin [m]

    def displacement(self, point: np.ndarray) -> np.ndarray:
        """Displacement of a point (3,) of the body [m]."""
        return self.D @ point + self.t


Motions = Mapping[str, BodyMotion]
"""Of bodies by name; of a robot of legs ``leg/element`` is the body behind an element."""

PLATFORM = "platform"
STILL = BodyMotion(np.zeros((3, 3)), np.zeros(3))


def node_key(name: str) -> str:
    """The name of a node of a flexible platform among bodies."""
    return f"{PLATFORM}, {name}"


def end_key(snapshot: Snapshot, i: int) -> str:
    """The body that leg i ends on: the platform, or the node that holds the leg."""
    placed = snapshot.platform
    return PLATFORM if placed is None else node_key(placed.holds[i])


def motion_under(posed: Snapshot | Network, bent: Deflection) -> Motions:
    """Motions of the bodies at the single pose that was loaded, of a deflection.

    The robot is the network of its parts; a body that can move alone keeps its place. Raises
    NoAnswerError when there is no deflection.
    """
    answer = bent.stiffness
    legs = network_of_legs(posed) if isinstance(posed, Snapshot) else None
    network: Any = posed if legs is None else legs.network
    v = (network.reference_point - answer.reference_point)[: network.space.translations]
    F, tolerance = move_wrench(bent.wrench, v), answer.details().tolerance
    nodes = {}
    response = network_under_loads(network, F, bent.forces, tolerance)
    for name, (twist, point) in response.motions.items():
        D = skew(twist[3:])
        nodes[name] = BodyMotion(D, twist[:3] - D @ point)
    if not isinstance(posed, Snapshot) or legs is None:
        return nodes
    known = {name: nodes[node] for name, node in legs.of_parts.items()}
    moved = {PLATFORM: nodes[network.platform]}
    moved |= {node_key(name): nodes[node] for name, node in legs.of_platform.items()}
    return _of_legs(posed, known, moved)


def finite_motions(posed: Any, places: BodyPlaces) -> Motions:
    """Motions of all bodies of a machine from its unloaded posture to their places."""
    bodies = {PLATFORM: places.platform, **{node_key(n): x for n, x in places.nodes.items()}}
    if isinstance(posed, Network):
        bodies = {posed.platform: places.platform, **places.nodes}
    moved = {name: BodyMotion(place.R - np.eye(3), place.t) for name, place in bodies.items()}
    if not isinstance(posed, Snapshot):
        return moved
    known = {n: BodyMotion(place.R - np.eye(3), place.t) for n, place in places.behind.items()}
    return _of_legs(posed, known, moved)


def _of_legs(snapshot: Snapshot, known: Motions, moved: dict[str, BodyMotion]) -> Motions:
    """All bodies of the legs, added to those that `moved`; `known` are behind the moving parts."""
    for i, leg in enumerate(snapshot.legs):
        _along(leg, f"{leg.name}/", STILL, known, moved)
        # nothing moves behind the last part that does
        for element in reversed(leg.elements):
            key = f"{leg.name}/{element.name}"
            moved[key] = moved[end_key(snapshot, i)]
            if isinstance(element, PlacedBlock) or key in known:
                break
    return moved


def _along(
    leg: PlacedLeg, prefix: str, body: BodyMotion, known: Motions, moved: dict[str, BodyMotion]
) -> BodyMotion:
    """Find the bodies of a leg from its first; the last one."""
    for element in leg.elements:
        if isinstance(element, PlacedBlock):
            ends = [_along(branch, prefix, body, known, moved) for branch in element.branches]
            body = ends[0]
        body = moved[prefix + element.name] = known.get(prefix + element.name, body)
    return body
