"""Machines at a posture as bodies and members between them, by which they are loaded."""

from __future__ import annotations

from collections import Counter
from functools import singledispatch
from typing import Any

import numpy as np

from robostiff.analysis import CableStiffness
from robostiff.elasticity import Elasticity
from robostiff.errors import InputError, Words
from robostiff.frozen import replace
from robostiff.kinematics.spanning_tree import connected_parts
from robostiff.model import Locked, PlacedBodySpring, PlacedSpring, Snapshot
from robostiff.model.body_spring import BASE, PLATFORM
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.network.assembly import (
    Assembly,
    Member,
    NamedBody,
    Part,
    SumOfJoints,
    is_rigid,
    moves,
    of_legs,
)
from robostiff.statics.loading.given_loads import DeadForce


@singledispatch
def assembly_of(posed: Any) -> Assembly:
    """A robot at one pose, or a network."""
    raise TypeError(type(posed).__name__)


@assembly_of.register
def _(posed: Snapshot) -> Assembly:
    for leg in posed.legs:
        times = Counter(part.name for part in leg.parts)
        for name in (name for name, count in times.items() if count > 1):
            raise InputError(
                "parts of a snapshot under load",
                got=Words(f"{leg.name}/{name}, twice"),
                expected="each name once in a leg: loads and masses are known by it",
            )
    return of_legs(posed.legs, posed.platform, posed.masses, posed.springs)


@assembly_of.register
def _of_cables(before: CableStiffness) -> Assembly:
    """A platform in its cables, as they are without the loads.

    What cables and weight leave is held by others, as a force at the reference point and a moment.
    """
    placed, rows = before.placed, list(before.space.rows)
    missing = np.zeros(6)
    if before.answered:
        missing[rows] = before.missing_wrench
    ends = zip(placed.exit_points, placed.attachments, strict=True)
    each = zip(before.cable_names, ends, before.axial, placed.lengths, before.tensions, strict=True)
    return Assembly(
        BASE,
        PLATFORM,
        springs=tuple(
            PlacedBodySpring(name, (BASE, PLATFORM), at, *map(float, numbers), is_cable=True)
            for name, at, *numbers in each
        ),
        expected="body but the platform",
        steady=(
            DeadForce(placed.weight_force, placed.weight_point),
            DeadForce(missing[:3], placed.reference_point),
        ),
        moment=np.where(np.arange(6) < 3, 0.0, missing)[rows],
    )


@assembly_of.register
def _of_network(network: Network) -> Assembly:
    """A network, all of it one leg."""
    found = Assembly(
        network.fixed[0],
        network.platform,
        [network.name],
        nodes={node.name: node.name for node in network.nodes},
    )
    for node in network.nodes:
        found.points[node.name] = at = np.asarray(node.point, dtype=float)
        found.names[node.name] = NamedBody(node.name), at
        found.frames[node.name] = np.eye(3), at
        found.masses += [(mass, NamedBody(node.name)) for mass in node.masses]
    places: dict[tuple[str, str, str, int], tuple[int, int]] = {}
    for number, e in enumerate(network.elements):
        parts: tuple[Part, ...]
        if isinstance(e, BeamElement):
            parts = (
                PlacedSpring(e.name, e.end, e.rotation, Elasticity(e.tip_compliance, segments=())),
            )
        elif isinstance(e, SpringElement):
            parts = (PlacedSpring(e.name, e.point, e.rotation, e.elasticity),)
        else:
            several = len(e.freedoms) > 1
            names = [f"{e.name}[{i}]" if several else e.name for i in range(len(e.freedoms))]
            named = (replace(freedom, name=n) for freedom, n in zip(e.freedoms, names, strict=True))
            parts = tuple(filter(moves, named))
        if all(map(is_rigid, parts)):
            parts = ()
        found.members.append(Member(e.a, e.b, parts, 0))
        if isinstance(e, JointElement):
            moving = [i for i, freedom in enumerate(e.freedoms) if moves(freedom)]
            for k, i in enumerate(moving):
                places[e.name, e.a, e.b, i] = number, k
                found.joints.setdefault(parts[k].name, (number, k))
            continue
        for mass in e.masses:
            along = mass.start is not None and bool(parts)
            place = NamedBody(e.b, number, 1) if along else NamedBody(e.b)
            found.masses.append((mass, place))
    found.members += [Member(network.fixed[0], other, (), 0) for other in network.fixed[1:]]
    of_body = connected_parts(
        (network.fixed[0], network.platform, *found.points),
        [(m.a, m.b) for m in found.members if not m.parts],
    )
    if of_body[network.platform] == network.fixed[0]:
        raise InputError(
            f"platform of {network.name!r}",
            got=Words("one that rigid parts hold"),
            expected="one that moves against the fixed bodies",
        )
    others = [name for name in dict.fromkeys(of_body.values()) if name != network.fixed[0]]
    listed = ", ".join([str(name) for name in others if name != network.platform][:5])
    found.expected = f"the name of a body that moves, or platform: {listed}"
    still = {name for name, body in of_body.items() if body == network.fixed[0]}
    found.names = {name: at for name, at in found.names.items() if name not in still}
    moving = ((m, at) for m, at in found.masses if at.member is not None or at.body not in still)
    found.masses = list(moving)
    for one in network.couplings:
        terms = [
            (places[key], joint.freedoms[i], factor)
            for joint, i, factor in one.terms
            if (key := (joint.name, joint.a, joint.b, i)) in places
            and of_body[joint.a] != of_body[joint.b]  # else it stays where it is
        ]
        if terms:
            follows, freedom, _ = terms[0]
            role = Locked(one.stiffness)
            drive = replace(freedom, name=one.name, role=role, coordinate=None)
            every = tuple((at, factor) for at, _, factor in terms)
            found.couplings.append(SumOfJoints(one.name, drive, follows, every))
    return found
