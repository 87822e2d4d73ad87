"""Flexible platforms under load: nodes that hold legs, parts between them, loads and masses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from robostiff.kinematics.spanning_tree import connected_parts
from robostiff.model import PlacedMass, PlacedPlatform, PlacedSpring, PlatformPart
from robostiff.spatial import skew
from robostiff.statics.chains.beam_bowing import SpringElements
from robostiff.statics.chains.carried_masses import CarriedMass, CarriedMasses
from robostiff.statics.chains.chain import FiniteChain
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.equations.problem import State
from robostiff.statics.loading.given_loads import DeadForce, load_vector

#: What its parts belong to, as the parts of a leg do to their leg.
_PLATFORM = "platform"


def on_flexible_platform(
    legs: LegGroup, placed: PlacedPlatform, elements: SpringElements
) -> LegGroup:
    """Legs that end at nodes: the tool is the platform, all other nodes are bodies between chains.

    Every part is a chain from its first node to its second. Where one begins at the tool, this is a
    body between chains, too, and an empty chain leads from there to the platform. `legs` is the
    group of all legs of the robot.
    """
    platform = placed.platform
    # nodes that rigid members hold together are one body
    rigid = [(part.a, part.b) for part in platform.parts if part.elasticity.is_rigid]
    body = connected_parts((platform.tool, *(n.name for n in platform.nodes)), rigid)
    names = [name for name in dict.fromkeys(body.values()) if name != platform.tool]
    first = len(legs.points)
    numbers: dict[str, int | None] = {name: first + i for i, name in enumerate(names)}
    numbers[platform.tool] = None
    owners = legs.owners or (0,) * len(legs.chains)
    chains = [
        chain if chain.end is not None else replace(chain, end=numbers[body[placed.holds[leg]]])
        for chain, leg in zip(legs.chains, owners, strict=True)
    ]
    for part in platform.parts:
        start, end = numbers[body[part.a]], numbers[body[part.b]]
        if start == end:
            continue
        spring = spring_of(part, placed)
        if start is None:
            start = first + len(names)
        chains.append(FiniteChain(start, end, tuple(elements.of(spring))))
    if any(chain.start == first + len(names) for chain in chains):
        chains.append(FiniteChain(first + len(names), None, ()))
        names.append(platform.tool)
    points = [np.asarray(placed.in_world(platform.point_of(name)), dtype=float) for name in names]
    number = len(legs.indices)
    return replace(
        legs,
        indices=(*legs.indices, number),
        names=(*legs.names, _PLATFORM),
        chains=tuple(chains),
        points=(*legs.points, *(point[None] for point in points)),
        owners=(*owners, *(number,) * (len(chains) - len(legs.chains))),
        nodes={name: numbers[own] for name, own in body.items()},
    )


def spring_of(part: PlatformPart, placed: PlacedPlatform) -> PlacedSpring:
    """A part of a flexible platform in the world, at one pose."""
    place = placed.in_world(part.point), placed.rotation @ part.axes
    return PlacedSpring(part.name, *place, part.elasticity)


def about_the_tool(
    group: LegGroup, state: State, by_twist: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What the nodes exert on each leg (r,), and its rate by the twist of the tool (r, r).

    About the point of the tool P, which moves along: with f at a node's point p, the moment has the
    rate ``dm + (dp - dP) x f + (p - P) x df``. The unknowns of the legs on the flexible platform
    move by `by_twist` (1, n, r).
    """
    (legs,), rows, platform = state.legs, list(group.rows), len(group.indices) - 1
    held = {
        body
        for chain, owner in zip(group.chains, group.owners, strict=True)
        if owner == platform
        for body in (chain.start, chain.end)
    }
    moved = np.eye(6)[:, rows]  # twist of the tool
    W, K = np.zeros((platform, 6)), np.zeros((platform, 6, len(rows)))
    for c, (chain, owner) in enumerate(zip(group.chains, group.owners, strict=True)):
        if owner == platform or chain.end not in held | {None}:
            continue
        own, rate, node = np.zeros(6), np.zeros((6, len(rows))), moved
        own[rows], rate[rows] = legs.W[c][0], by_twist[0, group.wrench_places[c]]
        arm = np.zeros(3)
        if chain.end is not None:
            node = np.zeros((6, len(rows)))
            node[rows] = by_twist[0, group.body_places[chain.end]]
            arm = legs.bodies[chain.end].p[0] - state.p
        rate[3:] += skew(arm) @ rate[:3] - skew(own[:3]) @ (node - moved)[:3]
        own[3:] += np.cross(arm, own[:3])
        W[owner] += own
        K[owner] += rate
    return list(W[:, rows]), list(K[:, rows])


def node_names(placed: PlacedPlatform | None) -> dict[str, str]:
    """The nodes of a platform by the names under which they carry loads, ``platform/node``."""
    if placed is None:
        return {}
    return {f"platform/{node.name}": node.name for node in placed.platform.nodes}


def on_platform_nodes(
    group: LegGroup,
    placed: PlacedPlatform,
    forces: Mapping[str, Sequence[DeadForce]],
    masses: Mapping[str, Sequence[PlacedMass]],
    gravity: np.ndarray,
) -> tuple[LegGroup, list[DeadForce], CarriedMasses]:
    """Legs on a flexible platform with what acts on it; what is on its tool; and its masses.

    Forces and masses are by the names of nodes. Gravity [m/s^2] makes weights of the masses of the
    platform, not of the given ones.
    """
    on_tool, carried = [], _along_parts(group, placed)
    if np.any(gravity):
        for own in carried:
            c, _ = group.place_of(own.leg, own.chain)
            group = group.with_loads(c, own.weights(gravity))
    for node, several in forces.items():
        at = placed.in_world(placed.platform.point_of(node))
        own = [DeadForce(f.force, at if f.point is None else f.point) for f in several]
        body = group.nodes[node]
        if body is None:
            on_tool += own
        else:
            points = [load_vector("point", node, f.point) for f in own]
            vectors = [load_vector("force", node, f.force) for f in own]
            group = group.with_forces(body, points, vectors)
    tool: list[PlacedMass] = []
    for node, several in masses.items():
        body = group.nodes[node]
        if body is None:
            tool += several
        else:
            leg, chain, after = group.held_at(body)
            carried += [CarriedMass(own, chain, after, leg=leg) for own in several]
    return group, on_tool, CarriedMasses(tuple(carried), tuple(tool))


def _along_parts(group: LegGroup, placed: PlacedPlatform) -> list[CarriedMass]:
    """Masses of the parts of a platform, each of which is a chain of the last leg."""
    leg = group.indices[-1]
    chains = [c for c, owner in enumerate(group.owners) if owner == len(group.indices) - 1]
    named = ((i, group.chains[c].elements) for i, c in enumerate(chains))
    numbers = {own[0].names[0]: i for i, own in named if own}
    masses, found = placed.masses, []
    for part in placed.platform.parts:
        if part.name not in numbers:
            continue
        chain = group.chains[chains[numbers[part.name]]]
        n = len(chain.elements)
        spring, end = spring_of(part, placed), placed.in_world(placed.platform.point_of(part.b))
        for mass in masses[part.name]:
            found.append(CarriedMass(mass, numbers[part.name], n, n, spring, end, leg))
    return found
