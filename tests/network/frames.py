"""Networks to test with, and the same in other units and from other places."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from robostiff import load
from robostiff.elasticity import CrossSection, material
from robostiff.model import Actuated, Passive, PlacedFreedom
from robostiff.network import JointElement, Network, Node, beam_between
from robostiff.spatial import Space

STEEL = material("steel")
BAR = CrossSection(4e-4, 1.2e-8, 3.1e-8, 2.5e-8, 0.85, 0.7)
GRAPHS = Path(__file__).parents[1] / "cases" / "graphs"
GRAPH_NAMES = sorted(path.stem for path in GRAPHS.glob("*.json"))


def graph(name: str) -> tuple[Network, dict[str, Any]]:
    """A graph case and its oracle."""
    path = GRAPHS / f"{name}.json"
    network = load(path)
    return network, json.loads(path.read_text())["oracle"]


def nodes(**points: Any) -> list[Node]:
    return [Node(name, np.array(point, dtype=float)) for name, point in points.items()]


def turning(point: Any, axis: Any, k: float | None = None) -> PlacedFreedom:
    return _freedom(0.0, point, axis, k)


def sliding(point: Any, axis: Any, k: float | None = None) -> PlacedFreedom:
    return _freedom(None, point, axis, k)


def ball(point: Any) -> tuple[PlacedFreedom, ...]:
    return tuple(turning(point, axis) for axis in np.eye(3))


def _freedom(pitch: float | None, point: Any, axis: Any, k: float | None) -> PlacedFreedom:
    unit = np.array(axis, dtype=float) / np.linalg.norm(axis)
    role = Passive() if k is None else Actuated(stiffness=k)
    return PlacedFreedom(unit, np.array(point, dtype=float), pitch, "dof", role)


def chain_of_beams(ends: np.ndarray, pieces: int) -> Network:
    """One straight beam, cut into pieces."""
    points = ends[0] + np.linspace(0, 1, pieces + 1)[:, None] * (ends[1] - ends[0])
    all_nodes = [Node(f"n{i}", point) for i, point in enumerate(points)]
    beams = [
        beam_between(a, b, STEEL, BAR, y_axis=[0.3, 1, 0.2], name=f"{a.name} {b.name}")
        for a, b in pairwise(all_nodes)
    ]
    tip = all_nodes[-1]
    return Network("chain", tuple(all_nodes), ("n0",), tip.name, tip.point, beams=tuple(beams))


def slender_frame() -> Network:
    """A planar frame of wires in triangles, with a hinge and a slide that is across no axis."""
    at = {"a": [0, 0, 0], "b": [0.9, 0.2, 0], "c": [1.3, 1.1, 0], "d": [0.3, 0.8, 0]}
    at |= {"e": [2.0, 0.4, 0], "pin": [0.9, 0.2, 0], "slide": [1.3, 1.1, 0]}
    by = {node.name: node for node in nodes(**at)}
    wire = CrossSection(6e-8, 3e-16, 3e-16, 6e-16)
    ends = ("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("a", "c"), ("pin", "e"), ("slide", "e")
    beams = (
        beam_between(by[a], by[b], STEEL, wire, y_axis=[0, 0, 1], name=f"{a} {b}") for a, b in ends
    )
    joints = (
        JointElement("pin", "pin", "b", (turning(at["b"], [0, 0, 1]),)),
        JointElement("slide", "slide", "c", (sliding(at["c"], [0.6, 0.8, 0]),)),
    )
    return Network(
        "frame",
        tuple(by.values()),
        ("a",),
        "e",
        by["e"].point,
        beams=tuple(beams),
        joints=joints,
        space=Space.PLANAR,
    )


def lattice(cells: int) -> Network:
    """A cube of beams along the edges of cubes, clamped at its lowest face."""
    sites = np.stack(np.meshgrid(*[np.arange(cells + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    at = {tuple(site): Node(str(tuple(map(int, site))), 0.3 * site) for site in sites}
    beams = [
        beam_between(node, at[neighbour], STEEL, BAR, name=f"{node.name} {i}")
        for site, node in at.items()
        for i in range(3)
        if (neighbour := tuple(np.array(site) + np.eye(3, dtype=int)[i])) in at
    ]
    tip = at[cells, cells, cells]
    fixed = tuple(node.name for site, node in at.items() if site[2] == 0)
    return Network("cube", tuple(at.values()), fixed, tip.name, tip.point, beams=tuple(beams))
