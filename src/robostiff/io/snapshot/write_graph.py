"""A network as the data of a snapshot file in its graph form."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError
from robostiff.io.snapshot.write import distinct, matrix_data
from robostiff.model import PlacedFreedom
from robostiff.network import BeamElement, JointElement, Network, SpringElement
from robostiff.spatial import Space


def network_to_data(network: Network) -> dict[str, Any]:
    """Plain data that `read_network` reads back, once written as JSON.

    Every beam and spring becomes a spring with its stiffness, or with its compliance if that is
    singular.

    Parameters
    ----------
    network : Network

    Raises
    ------
    InputError
        When a spring has directions both free and rigid, or nothing is elastic.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> network_to_data(network)["graph"]["springs"][0]["name"]
    'rod'
    """
    if not any(_gives_way(element) for element in network.elements):
        raise InputError(
            f"network {network.name} without compliance",
            expected="at least one beam, spring or joint with a stiffness",
        )
    data: dict[str, Any] = {"name": network.name or "network"}
    if network.description:
        data["description"] = network.description
    data["units"] = "SI: m, N, rad"
    if network.space is Space.PLANAR:
        data["planar"] = True
    data["reference_point"] = _plain(network.reference_point)
    springs = [
        _spring(element.name, element.a, element.b, *_elastic(element))
        for element in (*network.beams, *network.springs)
    ]
    joints = [_joint(joint) for joint in network.joints]
    data["graph"] = {
        "nodes": {node.name: _plain(node.point) for node in network.nodes},
        "fixed": list(network.fixed),
        "platform": network.platform,
        "springs": _named(springs),
        "joints": _named(joints),
    }
    return data


def _elastic(element: BeamElement | SpringElement) -> tuple[np.ndarray, np.ndarray, Elasticity]:
    if isinstance(element, BeamElement):
        return element.end, element.rotation, Elasticity(element.tip_compliance)
    return element.point, element.rotation, element.elasticity


def _spring(
    name: str, a: str, b: str, point: np.ndarray, rotation: np.ndarray, elasticity: Elasticity
) -> dict[str, Any]:
    place = {"point": _plain(point), "rotation": _plain(rotation)}
    return {"name": name, "a": a, "b": b, **place, **matrix_data(elasticity, name)}


def _joint(joint: JointElement) -> dict[str, Any]:
    moving = [f for f in joint.freedoms if f.is_passive or f.stiffness is not None]
    freedoms = [_freedom(freedom) for freedom in moving]
    return {"name": joint.name, "a": joint.a, "b": joint.b, "dofs": freedoms}


def _freedom(freedom: PlacedFreedom) -> dict[str, Any]:
    return {
        "kind": freedom.motion.value,
        "point": _plain(freedom.point),
        "axis": _plain(freedom.axis),
        "k": freedom.stiffness,
    }


def _named(parts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    names = distinct(part["name"] for part in parts)
    return [{**part, "name": name} for part, name in zip(parts, names, strict=True)]


def _gives_way(element: BeamElement | SpringElement | JointElement) -> bool:
    if isinstance(element, JointElement):
        return any(f.stiffness is not None for f in element.freedoms)
    return bool(np.any(_elastic(element)[2].compliance))


def _plain(values: np.ndarray) -> list[Any]:
    return np.asarray(values, dtype=float).tolist()
