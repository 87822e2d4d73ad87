"""Platforms in a model file, and springs between bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from robostiff.errors import Words
from robostiff.io.model_file.links import (
    THEORIES,
    MaterialChoice,
    SectionChoice,
    Theory,
    WrittenMatrices,
    build_material,
    build_section,
)
from robostiff.io.model_file.place import (
    Direction,
    Force,
    Length,
    Name,
    Place,
    Stiffness,
    Text,
    Vector,
    WrittenFrame,
    WrittenMapping,
)
from robostiff.model import (
    BodyPoint,
    BodySpring,
    FlexiblePlatform,
    Leg,
    PlatformNode,
    PlatformPart,
    platform_beam,
    rigid_member,
)
from robostiff.spatial import Frame
from robostiff.spatial.formula import is_above, vanishes

_Between = Annotated[list[Name], Field(min_length=2, max_length=2)]


class WrittenAttachment(WrittenFrame):
    """Where a leg meets the platform: a frame of it, or a node of a flexible platform."""

    node: Name | None = None


class WrittenMember(WrittenMapping):
    """A rigid member of a platform."""

    name: Name | None = None
    between: _Between = Field(description="the two nodes that it connects")

    def build(self, place: Place, name: str, nodes: dict[str, PlatformNode]) -> PlatformPart:
        """The member."""
        return rigid_member(*ends_of(place, self.between, nodes), name)


def ends_of(
    place: Place, between: Sequence[str], nodes: dict[str, PlatformNode]
) -> tuple[PlatformNode, PlatformNode]:
    """The two nodes that are written at ``between`` of a part."""
    for i, node in enumerate(between):
        if node not in nodes:
            raise (place / "between" / i).unknown("node of the platform", node, nodes)
    a, b = (nodes[node] for node in between)
    if a is b:
        raise (place / "between" / 1).error(
            "second node", got=b.name, expected="a node other than the first"
        )
    return a, b


class WrittenPlatformBeam(WrittenMember):
    """A beam of a platform."""

    material: MaterialChoice = Field(description="a name, such as steel")
    section: SectionChoice = Field(description="a name, or {circle: {diameter: 20 mm}}")
    y_axis: Direction | None = None
    theory: Theory | None = None

    def build(self, place: Place, name: str, nodes: dict[str, PlatformNode]) -> PlatformPart:
        """The beam."""
        a, b = ends_of(place, self.between, nodes)
        theory = THEORIES.get(self.theory)
        material = build_material(place / "material", self.material)
        section = build_section(place / "section", self.section, material, theory)
        y_axis = None if self.y_axis is None else (place / "y_axis").direction(self.y_axis)
        with place.complaints(hint="write y_axis: z or y_axis: [0, 0, 1] or the like"):
            return platform_beam(a, b, material, section, y_axis=y_axis, theory=theory, name=name)


class WrittenPlatformSpring(WrittenMatrices):
    """A spring of a platform, of its second node against its first."""

    name: Name | None = None
    between: _Between = Field(description="the two nodes that it connects")
    at: Vector | None = None

    def build(self, place: Place, name: str, nodes: dict[str, PlatformNode]) -> PlatformPart:
        """The spring."""
        a, b = ends_of(place, self.between, nodes)
        gap = a.at - b.at
        same = vanishes(gap) if gap.dtype == object else not np.any(gap)
        if self.at is None and not same:
            raise place.error(
                "spring between nodes at different places",
                got=Words("no at"),
                expected="at: [x, y, z], the point of the platform frame about which it is given",
            )
        at = a.at if self.at is None else (place / "at").point(self.at)
        return PlatformPart(name, a.name, b.name, at, self.turned(place), self.elasticity(place))


class WrittenPlatform(WrittenMapping):
    """A flexible platform."""

    nodes: Annotated[dict[Name, Vector], Field(min_length=2)] = Field(
        description="names and places, such as {hub: [0, 0, 0], rim: [r, 0, 0]}"
    )
    beams: list[WrittenPlatformBeam] = Field([])
    springs: list[WrittenPlatformSpring] = Field([])
    rigid: list[WrittenMember] = Field([])
    tool: Name = Field(description="the node that carries the reference point")
    legs: dict[str, Name] = Field(
        default_factory=dict,
        description="the node that holds each leg, where the position of its end is ambiguous",
    )

    def build(self, place: Place) -> FlexiblePlatform:
        """The platform."""
        nodes = {
            name: PlatformNode(name, (place / "nodes" / name).point(at))
            for name, at in self.nodes.items()
        }
        parts: list[PlatformPart] = []
        for key, kind in (("beams", "beam"), ("springs", "spring"), ("rigid", "rigid")):
            for i, member in enumerate(getattr(self, key)):
                here, name = place / key / i, member.name or f"{kind}{i + 1}"
                if name in (part.name for part in parts):
                    raise (here / "name" if member.name else here).error(
                        "name of a part of the platform", got=name, expected="each name once"
                    )
                parts.append(member.build(here, name, nodes))
        if self.tool not in nodes:
            raise (place / "tool").unknown("tool of the platform", self.tool, nodes)
        with place.complaints():
            return FlexiblePlatform(tuple(nodes.values()), tuple(parts), self.tool)


class WrittenBodyPoint(WrittenMapping):
    """A point of a body: in the world, in the platform frame, or where a part begins."""

    body: Text = Field(description="base, platform, or leg/part for the body behind that part")
    at: Vector | None = None


class WrittenBodySpring(WrittenMapping):
    """A spring between points of two bodies, such as a gravity compensator."""

    name: Text = Field(description="the name of the spring")
    between: Annotated[list[WrittenBodyPoint], Field(min_length=2, max_length=2)] = Field(
        description="its two ends, such as [{body: base, at: [0, 0, 1 m]}, {body: arm/upper arm}]"
    )
    stiffness: Stiffness = Field(description="the stiffness, such as 2 kN/m")
    free_length: Length | None = None
    preload: Force | None = None

    def build(self, place: Place) -> BodySpring:
        """The spring."""
        first, second = (
            BodyPoint(end.body, (place / "between" / j / "at").point(end.at))
            for j, end in enumerate(self.between)
        )
        numbers = self.numbers(place)
        if is_above(0, numbers["stiffness"]):
            raise (place / "stiffness").error(
                "stiffness", got=self.stiffness, expected="zero or more, such as 2 kN/m"
            )
        with place.complaints():
            return BodySpring(self.name, (first, second), **numbers)


def attach(
    legs: list[tuple[Place, Leg]],
    platform: FlexiblePlatform | None,
    top: Place,
    written: WrittenPlatform | None,
    known: Sequence[str] = (),
) -> list[tuple[Place, Leg]]:
    """The legs, each held by its node of the platform, which is written at `top`.

    `known` are the nodes of the legs, if they were found with numbers before.
    """
    if platform is None or written is None:
        for place, leg in legs:
            if leg.node is not None:
                raise (place / "platform" / "node").error(
                    "node that holds the leg",
                    got=leg.node,
                    expected="at: [x, y, z], as the platform is rigid",
                    hint="nodes are those of platform: at the top of the file",
                )
        return legs
    names = [leg.name for _, leg in legs]
    for name, node in written.legs.items():
        here = top / "legs" / name
        if name not in names:
            raise here.unknown("leg on the platform", name, names, key=True)
        if node not in written.nodes:
            raise here.unknown("node that holds the leg", node, written.nodes)
    named = known or [written.legs.get(name) for name in names]
    legs_at_nodes = []
    for (place, leg), known_node in zip(legs, named, strict=True):
        hint = f"write {leg.name}: {platform.nodes[0].name} or the like under legs: of the platform"
        with (place / "platform").complaints(hint=hint):
            node = known_node or platform.node_of(leg.node, leg.attachment.p)
        attachment = leg.attachment
        if leg.node is not None:
            attachment = Frame(attachment.R, platform.point_of(node))
        legs_at_nodes.append((place, replace(leg, node=node, attachment=attachment)))
    return legs_at_nodes
