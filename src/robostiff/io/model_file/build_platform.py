"""Platforms in a model file, and springs between bodies: keys, and what is built of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from robostiff.io.model_file.build_link import WrittenMatrices, build_elasticity
from robostiff.io.model_file.place import Place, axes_of, direction, point
from robostiff.io.model_file.stock import MaterialChoice, SectionChoice, Stock, Theory, read_theory
from robostiff.io.model_file.written_parts import (
    Direction,
    Name,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenMapping,
)
from robostiff.io.suggest import Words
from robostiff.io.units import Dimension
from robostiff.kinematics import find_posture, with_body_springs
from robostiff.model import (
    BodyPoint,
    BodySpring,
    FlexiblePlatform,
    Leg,
    PlatformNode,
    PlatformPart,
    Robot,
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


class WrittenPlatformBeam(WrittenMember):
    """A beam of a platform."""

    material: MaterialChoice = Field(description="a name, such as steel")
    section: SectionChoice = Field(description="a name, or {circle: {diameter: 20 mm}}")
    y_axis: Direction | None = None
    theory: Theory = "euler-bernoulli"


class WrittenPlatformSpring(WrittenMatrices):
    """A spring of a platform, of its second node against its first."""

    name: Name | None = None
    between: _Between = Field(description="the two nodes that it connects")
    at: Vector | None = None


class WrittenPlatform(WrittenMapping):
    """A flexible platform."""

    nodes: Annotated[dict[Name, Vector], Field(min_length=2)] = Field(
        description="names and places, such as {hub: [0, 0, 0], rim: [r, 0, 0]}"
    )
    beams: list[WrittenPlatformBeam] = Field(default_factory=list)
    springs: list[WrittenPlatformSpring] = Field(default_factory=list)
    rigid: list[WrittenMember] = Field(default_factory=list)
    tool: Name = Field(description="the node that carries the reference point")
    legs: dict[str, Name] = Field(
        default_factory=dict,
        description="the node that holds each leg, where the position of its end is ambiguous",
    )


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
    stiffness: Value = Field(description="the stiffness, such as 2 kN/m")
    free_length: Value | None = None
    preload: Value | None = None


_Member = WrittenPlatformBeam | WrittenPlatformSpring | WrittenMember


def build_platform(
    place: Place, written: WrittenPlatform | None, stock: Stock
) -> FlexiblePlatform | None:
    """The platform that is written at a place; None for a rigid one."""
    if written is None:
        return None
    nodes = {
        name: PlatformNode(name, point(place / "nodes" / name, at))
        for name, at in written.nodes.items()
    }
    lists = (("beams", "beam"), ("springs", "spring"), ("rigid", "rigid"))
    members: list[tuple[Place, str, _Member]] = [
        (place / key / i, f"{kind}{i + 1}", member)
        for key, kind in lists
        for i, member in enumerate(getattr(written, key))
    ]
    parts: list[PlatformPart] = []
    for here, default, member in members:
        name = member.name or default
        if name in (part.name for part in parts):
            raise (here / "name" if member.name else here).error(
                "name of a part of the platform", got=name, expected="each name once"
            )
        parts.append(_part(here, name, member, nodes, stock))
    if written.tool not in nodes:
        raise (place / "tool").unknown("tool of the platform", written.tool, nodes)
    with place.complaints():
        return FlexiblePlatform(tuple(nodes.values()), tuple(parts), written.tool)


def attached(
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
    held = []
    for (place, leg), given in zip(legs, named, strict=True):
        hint = f"write {leg.name}: {platform.nodes[0].name} or the like under legs: of the platform"
        with (place / "platform").complaints(hint=hint):
            node = given or platform.node_of(leg.node, leg.attachment.p)
        if leg.node is None:
            held.append((place, replace(leg, node=node)))
        else:
            attachment = Frame(leg.attachment.R, platform.point_of(node))
            held.append((place, replace(leg, attachment=attachment)))
    return held


def check_platform(place: Place, robot: Robot) -> None:
    """Raise at the platform unless its flexibility can be computed; for a robot of numbers."""
    if robot.platform is not None:
        from robostiff.network import platform_flexibility

        with place.complaints():
            platform_flexibility(robot.platform, list(dict.fromkeys(robot.holds)), robot.space)


def _part(
    place: Place, name: str, written: _Member, nodes: dict[str, PlatformNode], stock: Stock
) -> PlatformPart:
    for i, node in enumerate(written.between):
        if node not in nodes:
            raise (place / "between" / i).unknown("node of the platform", node, nodes)
    a, b = (nodes[node] for node in written.between)
    if a is b:
        raise (place / "between" / 1).error(
            "second node", got=b.name, expected="a node other than the first"
        )
    if isinstance(written, WrittenPlatformBeam):
        theory = read_theory(written.theory)
        material = stock.material(place / "material", written.material)
        section = stock.section(place / "section", written.section, material, theory)
        y_axis = None if written.y_axis is None else direction(place / "y_axis", written.y_axis)
        with place.complaints(hint="write y_axis: z or y_axis: [0, 0, 1] or the like"):
            return platform_beam(a, b, material, section, y_axis=y_axis, theory=theory, name=name)
    if isinstance(written, WrittenPlatformSpring):
        gap = a.at - b.at
        same = vanishes(gap) if gap.dtype == object else not np.any(gap)
        if written.at is None and not same:
            raise place.error(
                "spring between nodes at different places",
                got=Words("no at"),
                expected="at: [x, y, z], the point of the platform frame about which it is given",
            )
        at = a.at if written.at is None else point(place / "at", written.at)
        axes = axes_of(place, written)
        return PlatformPart(name, a.name, b.name, at, axes, build_elasticity(place, written))
    return rigid_member(a, b, name)


def build_body_springs(
    place: Place, written: Sequence[WrittenBodySpring]
) -> tuple[BodySpring, ...]:
    """The springs that are written, in any order."""
    springs = []
    for i, own in enumerate(written):
        here = place / i
        ends = [
            BodyPoint(end.body, point(here / "between" / j / "at", end.at))
            for j, end in enumerate(own.between)
        ]
        k = (here / "stiffness").number(own.stiffness, Dimension.TRANSLATIONAL_STIFFNESS)
        if is_above(0, k):
            raise (here / "stiffness").error(
                "stiffness", got=own.stiffness, expected="zero or more, such as 2 kN/m"
            )
        length = here.number_at(own, "free_length", Dimension.LENGTH)
        preload = here.number_at(own, "preload", Dimension.FORCE)
        with here.complaints():
            springs.append(BodySpring(own.name, (ends[0], ends[1]), k, length, preload))
    return tuple(springs)


def check_body_springs(place: Place, robot: Robot) -> None:
    """Raise at a spring whose bodies the robot does not have."""
    if robot.springs:
        for i, spring in enumerate(robot.springs):
            alone = robot.with_springs((spring,))
            with (place / i / "between").complaints():
                with_body_springs(find_posture(alone, None))
