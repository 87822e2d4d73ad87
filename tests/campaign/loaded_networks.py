"""Random frames under loads, against bodies in the world."""
# pyright: reportArgumentType=false

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elasticity import circle, elasticity_from_stiffness, material, rectangle
from robostiff.model import Actuated, Locked, Passive, PlacedFreedom, PlacedMass
from robostiff.network import JointElement, Node, SpringElement, beam_between
from tests.campaign.answers import Complaint, Judge
from tests.campaign.assembled import NotAssembledError, of_network
from tests.campaign.bodies import DeadPull, NoMinimumError
from tests.campaign.minima import compare, least
from tests.generators.chains import random_block, random_rotation, rigidities

_STEEL = material("steel")


@dataclass
class Frame:
    """Nodes and beams, from which networks are made, also with beams cut."""

    nodes: dict[str, Node] = field(default_factory=dict)
    fixed: list[str] = field(default_factory=list)
    beams: dict[str, tuple[str, str, Any, Any, Any]] = field(default_factory=dict)
    springs: list[SpringElement] = field(default_factory=list)
    joints: list[JointElement] = field(default_factory=list)
    platform: str = ""

    def node(self, name: str, point: np.ndarray) -> str:
        """A node by its name."""
        self.nodes[name] = Node(name, np.asarray(point, dtype=float))
        return name

    def network(self, cut: dict[str, list[float]] | None = None) -> rs.Network:
        """With beams cut at parts of their lengths, into ``name 0``, ``name 1`` and so on."""
        nodes, beams = dict(self.nodes), []
        for name, (a, b, section, y, theory) in self.beams.items():
            ends = [a]
            start, end = nodes[a].point, nodes[b].point
            for i, s in enumerate((cut or {}).get(name, [])):
                own = f"{name} at {i}"
                nodes[own] = Node(own, start + s * (end - start))
                ends.append(own)
            ends.append(b)
            for i, (one, other) in enumerate(pairwise(ends)):
                own = f"{name} {i}" if len(ends) > 2 else name
                pair = nodes[one], nodes[other]
                beams.append(
                    beam_between(*pair, _STEEL, section, y_axis=y, theory=theory, name=own)
                )
        point = self.nodes[self.platform].point
        return rs.Network(
            "frame",
            tuple(nodes.values()),
            tuple(self.fixed),
            self.platform,
            point,
            tuple(beams),
            tuple(self.springs),
            tuple(self.joints),
        )

    @property
    def sections(self) -> dict[str, tuple[float, ...]]:
        """Rigidities of beams."""
        return {
            name: rigidities(_STEEL, section, theory)
            for name, (_, _, section, _, theory) in self.beams.items()
        }


def _section(rng: np.random.Generator) -> Any:
    a, b = 10 ** rng.uniform(-2.3, -1.2, 2)
    return circle(float(a)) if rng.uniform() < 0.5 else rectangle(float(a), float(b))


def _theory(rng: np.random.Generator) -> Any:
    return rs.Timoshenko() if rng.uniform() < 0.3 else rs.EulerBernoulli()


def _freedoms(rng: np.random.Generator, point: np.ndarray, R: np.ndarray) -> tuple[Any, ...]:
    """A joint between two nodes: hinge, slide, screw, universal or ball joint."""
    sort = rng.choice(["hinge", "slide", "screw", "universal", "ball"])

    def one(i: int, pitch: float | None = 0.0) -> PlacedFreedom:
        k = float(10 ** rng.uniform(3, 5))
        role = (Passive(), Locked(k), Actuated(k))[rng.integers(3)]
        return PlacedFreedom(R[:, i], point, pitch, f"dof{i}", role)

    match sort:
        case "hinge":
            return (one(0),)
        case "slide":
            return (one(0, None),)
        case "screw":
            return (one(0, float(rng.uniform(0.01, 0.1))),)
        case "universal":
            return one(0), one(1)
        case _:
            return one(0), one(1), one(2)


def random_frame(rng: np.random.Generator) -> Frame:
    """Beams from node to node, some through joints, with circuits and springs to the ground."""
    frame, count = Frame(), int(rng.integers(2, 6))
    for i in range(count):
        frame.node(f"n{i}", rng.uniform(-0.6, 0.6, 3))
    frame.fixed = ["n0", "n1"] if count > 3 and rng.uniform() < 0.6 else ["n0"]
    frame.platform = f"n{count - 1}"
    pairs = [(int(rng.integers(i)), i) for i in range(len(frame.fixed), count)]
    pairs += [
        tuple(sorted(rng.choice(count - 1, 2, replace=False).tolist()))
        for _ in range(int(rng.integers(0, 3)))
        if count > 2
    ]
    for k, (i, j) in enumerate(pairs):
        if i == j or {f"n{i}", f"n{j}"} <= set(frame.fixed):
            continue
        end = f"n{j}"
        if rng.uniform() < 0.35:
            point = frame.nodes[end].point
            hidden = frame.node(f"h{k}", point)
            own = _freedoms(rng, point, random_rotation(rng))
            frame.joints.append(JointElement(f"joint{k}", hidden, end, own))
            end = hidden
        frame.beams[f"beam{k}"] = (f"n{i}", end, _section(rng), rng.normal(size=3), _theory(rng))
    for k in range(int(rng.integers(0, 2))):
        node = f"n{rng.integers(len(frame.fixed), count)}"
        K = random_block(rng).stiffness * 1e3
        own = elasticity_from_stiffness(K)
        point = frame.nodes[node].point + rng.uniform(-0.1, 0.1, 3)
        frame.springs.append(
            SpringElement(f"spring{k}", "n0", node, point, random_rotation(rng), own)
        )
    return frame


def loaded_network(rng: np.random.Generator) -> list[Complaint]:
    """A frame under a wrench, forces at nodes and weights."""
    frame, judge = random_frame(rng), Judge(None, 1.0, False)
    for name, node in list(frame.nodes.items()):
        if name not in frame.fixed and rng.uniform() < 0.3:
            centre = node.point + rng.uniform(-0.1, 0.1, 3)
            mass = PlacedMass(name, np.array(rng.uniform(0.1, 5)), centre)
            frame.nodes[name] = replace(node, masses=(mass,))
    network = frame.network()
    unloaded = rs.stiffness(network)
    doubt = rs.Status.ILL_CONDITIONED | rs.Status.FREE_MOTIONS | rs.Status.RIGID_DIRECTION
    if unloaded.status & doubt:
        return []
    try:
        own = of_network(network, frame.sections)
        length = own.bodies.length
        scale = np.repeat([length, 1.0], 3)
        F = unloaded.K @ (rng.normal(size=6) * scale * 10 ** rng.uniform(-5, -2))
        force = float(np.max(np.abs(F / scale))) * length
        loads: dict[str, Any] = {}
        for name, (body, point) in own.behind.items():
            if body > 1 and not name.startswith("h") and rng.uniform() < 0.3:
                pull = 0.1 * force * rng.normal(size=3)
                loads[name] = rs.DeadForce(pull, point)
                own.bodies.pulls.append(DeadPull(body, point, pull))
        more: dict[str, Any] = {"loads": loads} if loads else {}
        if rng.uniform() < 0.4:
            more["gravity"] = rng.uniform(-10, 10, 3)
            own.fall(more["gravity"])
        truth = least(own, F)
    except (NotAssembledError, NoMinimumError):
        return []
    compare(judge, partial(rs.equilibrium, network, None, F, **more), own, truth, scale)
    return judge.complaints
