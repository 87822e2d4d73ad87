"""A linkage as a network: at joint coordinates, where its loops close."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robostiff.errors import NoAnswerError
from robostiff.kinematics import place_chain
from robostiff.kinematics.placed_masses import placed_with_masses
from robostiff.linkage.closure import Configuration
from robostiff.linkage.driven import DrivenLinkage
from robostiff.linkage.linkage import Connection, JointValues, Linkage
from robostiff.model import Joint, Link, PlacedFreedom
from robostiff.network import JointElement, Network, Node, SpringElement
from robostiff.spatial import Frame

# Under this name a linkage keeps its closed home, by the joints that drive it.
_KEPT = "_driven"


def network_at(linkage: Linkage, values: JointValues | None = None) -> Network:
    """The part of a linkage between base and platform as a network, see `Linkage.network_at`."""
    return network_of(*closed_at(linkage, values))


def closed_at(linkage: Linkage, values: JointValues | None = None) -> tuple[Linkage, Configuration]:
    """The part of a linkage between base and platform, closed; as `network_at`.

    Every path begins at the same home, which is closed once.
    """
    given = linkage.checked(values or {})
    known: dict[tuple[str, ...], DrivenLinkage] = vars(linkage).setdefault(_KEPT, {})
    names = tuple(given)
    if names not in known:
        known[names] = DrivenLinkage.moved_by(linkage, names)
    driven = known[names]
    (found,) = driven.at(np.concatenate([np.zeros(0), *(given[x] for x in driven.drives)])[None])
    if not found.is_closed:
        raise NoAnswerError(
            f"the loops of {linkage.name!r} do not close: {found.complaint}; {found.advice}"
        )
    return driven.part, found


def network_of(part: Linkage, found: Configuration) -> Network:
    """An essential linkage in a closed configuration as a network."""
    platform = found.frames[part.platform]
    joints, springs = [], []
    for c in part.connections:
        if isinstance(c.element, Link):
            springs.append(_spring(c, found))
        else:
            freedoms = _placed_freedoms(c, found.coordinates[c.name], found.frames[c.a])
            joints.append(JointElement(c.name, c.a, c.b, tuple(freedoms)))
    return Network(
        part.name,
        tuple(Node(body, found.frames[body].p) for body in part.bodies),
        (part.base,),
        part.platform,
        platform.p + platform.R @ part.reference_point,
        springs=tuple(springs),
        joints=tuple(joints),
        description=part.title,
    )


def _spring(c: Connection, found: Configuration) -> SpringElement:
    base = found.frames[c.a] @ c.before
    leg = placed_with_masses(c.name, c.chain, found.coordinates[c.name], base)
    (placed,) = leg.springs
    masses = tuple(replace(mass, after=0) for mass in leg.masses)
    place = placed.point, placed.rotation, placed.elasticity
    return SpringElement(c.name, c.a, c.b, *place, masses)


def _placed_freedoms(connection: Connection, q: np.ndarray, frame_a: Frame) -> list[PlacedFreedom]:
    """The elementary joints of a joint in the world, where body a is."""
    if not isinstance(connection.element, Joint):
        return []
    start = frame_a @ connection.before
    return place_chain(connection.chain, q, start.R, start.p).freedoms
