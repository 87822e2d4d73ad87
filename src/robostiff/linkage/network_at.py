"""A linkage at joint coordinates as a network."""

from __future__ import annotations

from dataclasses import replace

from robostiff.errors import NoAnswerError
from robostiff.kinematics.placed_masses import placed_with_masses
from robostiff.linkage.closure import Configuration, close, placed_freedoms
from robostiff.linkage.essential import essential
from robostiff.linkage.linkage import Connection, JointValues, Linkage
from robostiff.model import Chain, Link
from robostiff.network import JointElement, Network, Node, SpringElement


def network_at(linkage: Linkage, values: JointValues | None = None) -> Network:
    """The part of a linkage between base and platform as a network, see `Linkage.network_at`."""
    return network_of(*closed_at(linkage, values))


def closed_at(linkage: Linkage, values: JointValues | None = None) -> tuple[Linkage, Configuration]:
    """The part of a linkage between base and platform, closed; as `network_at`."""
    given = linkage.checked(values or {})
    part = essential(linkage.in_floats)
    felt = {joint.name for joint in part.joints}
    found = close(part, {name: q.tolist() for name, q in given.items() if name in felt})
    if not found.is_closed:
        raise NoAnswerError(
            f"the loops of {linkage.name!r} do not close: {found.complaint}; {found.advice}"
        )
    return part, found


def network_of(part: Linkage, found: Configuration) -> Network:
    """An essential linkage in a closed configuration as a network."""
    platform = found.frames[part.platform]
    joints, springs = [], []
    for c in part.connections:
        if isinstance(c.element, Link):
            springs.append(_spring(c, c.element, found))
        else:
            freedoms = placed_freedoms(c, found.coordinates[c.name], found.frames[c.a])
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


def _spring(c: Connection, link: Link, found: Configuration) -> SpringElement:
    base = found.frames[c.a] @ c.before
    leg = placed_with_masses(c.name, Chain((link,)), found.coordinates[c.name], base)
    (placed,) = leg.springs
    masses = tuple(replace(mass, after=0) for mass in leg.masses)
    place = placed.point, placed.rotation, placed.elasticity
    return SpringElement(c.name, c.a, c.b, *place, masses)
