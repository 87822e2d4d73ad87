"""What a network consists of, as plain data."""

from __future__ import annotations

from typing import Any

from robostiff.network import Network


def network_facts(network: Network) -> dict[str, Any]:
    """Facts for ``robostiff check``, the stiffness aside."""
    freedoms = [f for joint in network.joints for f in joint.freedoms]
    return {
        "name": network.name,
        "kind": "network",
        "title": network.description,
        "source": "",
        "space": network.space.name.lower(),
        "coordinates": [],
        "legs": [],
        "bodies": len(network.nodes),
        "beams": len(network.beams),
        "springs": len(network.springs),
        "joints": len(network.joints),
        "passive_freedoms": sum(f.is_passive for f in freedoms),
        "elastic_freedoms": sum(f.stiffness is not None for f in freedoms),
    }
