"""Random robots whose platform bends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import robostiff as rs
from robostiff.model import (
    FlexiblePlatform,
    PlacedPlatform,
    PlatformNode,
    PlatformPart,
    platform_beam,
    rigid_member,
)
from tests.generators.chains import random_rotation

STEEL = rs.material("steel")
BAR = rs.CrossSection(4e-4, 1.2e-8, 3.1e-8, 2.5e-8)


def _part(rng: np.random.Generator, kind: str, a: PlatformNode, b: PlatformNode, name: str):
    if kind == "beam":
        return platform_beam(a, b, STEEL, BAR, y_axis=rng.normal(size=3), name=name)
    if kind == "rigid":
        return rigid_member(a, b, name)
    point, axes = rng.uniform(-0.5, 0.5, 3), random_rotation(rng)
    root = rng.normal(size=(6, 6)) * np.repeat([1e-4, 1e-3], 3)[:, None]
    if kind == "spring":
        return PlatformPart(name, a.name, b.name, point, axes, rs.Elasticity(root @ root.T))
    hinge = np.eye(6)[:, 3:4]  # a spring that turns freely about its own x axis
    C = root @ root.T
    C[3, :] = C[:, 3] = 0.0
    return PlatformPart(name, a.name, b.name, point, axes, rs.Elasticity(C, hinge))


def _joined(
    rng: np.random.Generator, nodes: list[PlatformNode], kinds: tuple[str, ...], closing: int
) -> tuple[PlatformPart, ...]:
    """A tree of parts between nodes, and `closing` more parts; none is a beam without length."""
    ends = [(int(rng.integers(i)), i) for i in range(1, len(nodes))]
    for _ in range(closing):
        a, b = rng.choice(len(nodes), 2, replace=False)
        ends.append((int(a), int(b)))
    parts = []
    for i, (a, b) in enumerate(ends):
        kind = kinds[rng.integers(len(kinds))]
        if kind == "beam" and np.allclose(nodes[a].at, nodes[b].at):
            kind = "rigid"
        parts.append(_part(rng, kind, nodes[a], nodes[b], f"part{i}"))
    return tuple(parts)


def on_platform(
    rng: np.random.Generator, robot: rs.Snapshot, kinds: tuple[str, ...], count: int, closing: int
) -> rs.Snapshot:
    """A robot on `count` nodes joined by a tree of parts, and `closing` more parts."""
    nodes = [PlatformNode(f"n{i}", rng.uniform(-0.5, 0.5, 3)) for i in range(count)]
    parts = _joined(rng, nodes, kinds, closing)
    platform = FlexiblePlatform(tuple(nodes), parts, "n0")
    holds = tuple(f"n{rng.integers(count)}" for _ in robot.legs)
    placed = PlacedPlatform(platform, holds, random_rotation(rng), rng.uniform(-1, 1, 3))
    return replace(robot, platform=placed)


def shipped_on_platform(
    name: str, seed: int, kinds: tuple[str, ...] = ("beam",), closing: int = 0
) -> rs.Robot:
    """A shipped robot whose legs end at nodes of a flexible platform, the tool at its origin."""
    rng = np.random.default_rng(seed)
    robot = rs.load(name)
    hub = PlatformNode("hub", np.zeros(3))
    nodes = [hub, *(PlatformNode(f"n{i}", leg.attachment.p) for i, leg in enumerate(robot.legs))]
    parts = _joined(rng, nodes, kinds, closing)
    legs = tuple(replace(leg, node=f"n{i}") for i, leg in enumerate(robot.legs))
    return replace(robot, legs=legs, platform=FlexiblePlatform(tuple(nodes), parts, "hub"))


KINDS_OF_PARTS = (("beam",), ("beam", "spring", "rigid"), ("beam", "hinge", "spring"))
