"""Loads and masses of flexible platforms: at their nodes, and along the parts between these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robostiff.model import PlacedMass, PlacedPlatform
from robostiff.statics.chains.carried_masses import CarriedMass, CarriedMasses
from robostiff.statics.chains.legs import LegGroup
from robostiff.statics.equations.flexible_platform import spring_of
from robostiff.statics.loading.given_loads import DeadForce, load_vector


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
