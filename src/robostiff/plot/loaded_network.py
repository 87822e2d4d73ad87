"""Networks and linkages under finite loads and in their modes, beside their places without load."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from robostiff.analysis import PartShare
from robostiff.network import Network
from robostiff.plot.geometry.displacement import BodyMotion, FiniteMotion
from robostiff.plot.picture import Item, PlainColour, Scene
from robostiff.plot.robot_parts import (
    energy_scale,
    exaggerated,
    finite_factor,
    robot_scene,
    unit_of,
)
from robostiff.plot.structures import (
    NetworkDrawing,
    energies_by_name,
    is_level,
    network_factor,
    network_ghost,
    network_items,
    network_joint_names,
    network_load,
    network_points,
    size_of,
)
from robostiff.spatial import Space
from robostiff.statics import BodyPlace, BodyPlaces

_SAME = 1e-9  # of the structure


def motions_of(network: Network, places: BodyPlaces) -> dict[str, BodyMotion]:
    """Motions of the bodies of a network, of which the fixed ones rest."""
    still = BodyPlace(np.eye(3), np.zeros(3))
    nodes: Mapping[str, BodyPlace] = {network.platform: places.platform, **places.nodes}
    return {one.name: FiniteMotion.of(nodes.get(one.name, still)) for one in network.nodes}


def moved_network_scene(
    title: str,
    network: Network,
    motions: Mapping[str, BodyMotion],
    scale: float,
    shares: Iterable[PartShare],
    load: tuple[np.ndarray, np.ndarray] | None = None,
    notes: tuple[str, ...] = (),
    at_rest: str = "without load",
) -> Scene:
    """A network with displaced bodies, coloured by elastic energy; under a load, with its arrows.

    The load is a point (3,) of the platform, where it is at rest, and a wrench (6,) about it.
    """
    points = network_points(network)
    factor, unit = unit_of(size_of(points))
    paints = energies_by_name(shares)
    plain = PlainColour.MUTED if paints else PlainColour.INK
    drawn = NetworkDrawing(network, factor, paints, plain, motions=motions, scale=scale)
    is_flat = network.space is Space.PLANAR or (
        is_level(points)
        and all(
            abs(motions[one.name].displacement(one.point)[2]) <= _SAME * size_of(points)
            for one in network.nodes
        )
    )
    items: list[Item] = network_ghost(NetworkDrawing(network, factor), at_rest) if scale else []
    items += [*network_items(drawn), *network_joint_names(drawn)]
    if load is not None:
        items += network_load(drawn, *load, is_flat)
    known = energy_scale(value for value in paints.values() if isinstance(value, float))
    return robot_scene(title, items, unit, is_flat, known, notes)


def loaded_network_scene(
    network: Network,
    places: BodyPlaces,
    shares: Iterable[PartShare],
    load: tuple[np.ndarray, np.ndarray],
    exaggeration: float | None,
    notes: tuple[str, ...],
) -> Scene:
    """A network where it comes to rest under a load, as `moved_network_scene` takes it."""
    motions = motions_of(network, places)
    scale = exaggeration
    if scale is None:
        scale = finite_factor(network_factor(network, motions))
    title = f"{network.name} under load"
    notes = (*exaggerated(scale), *notes)
    return moved_network_scene(title, network, motions, scale, shares, load, notes)
