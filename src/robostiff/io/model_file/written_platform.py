"""How a platform that bends is written in a model file, and where legs meet the platform."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from robostiff.io.model_file.written_elements import WrittenMatrices
from robostiff.io.model_file.written_parts import (
    Direction,
    MaterialChoice,
    SectionChoice,
    Theory,
    Vector,
    Written,
    WrittenFrame,
)

_Node = Annotated[str, Field(min_length=1)]
_Between = Annotated[list[_Node], Field(min_length=2, max_length=2)]


class WrittenAttachment(WrittenFrame):
    """Where a leg meets the platform: a frame of it, or a node of a platform that bends."""

    node: _Node | None = None


class WrittenMember(Written):
    """A rigid member of a platform."""

    name: _Node | None = None
    between: _Between = Field(description="the two nodes that it connects")


class WrittenPlatformBeam(WrittenMember):
    """A beam of a platform."""

    material: MaterialChoice = Field(description="a name, such as steel")
    section: SectionChoice = Field(description="a name, or {circle: {diameter: 20 mm}}")
    y_axis: Direction | None = None
    theory: Theory = "euler-bernoulli"


class WrittenPlatformSpring(WrittenMatrices):
    """A spring of a platform, of its second node against its first."""

    name: _Node | None = None
    between: _Between = Field(description="the two nodes that it connects")
    at: Vector | None = None


class WrittenPlatform(Written):
    """A platform that bends."""

    nodes: Annotated[dict[_Node, Vector], Field(min_length=2)] = Field(
        description="names and places, such as {hub: [0, 0, 0], rim: [r, 0, 0]}"
    )
    beams: list[WrittenPlatformBeam] = Field(default_factory=list)
    springs: list[WrittenPlatformSpring] = Field(default_factory=list)
    rigid: list[WrittenMember] = Field(default_factory=list)
    tool: _Node = Field(description="the node that carries the reference point")
    legs: dict[str, _Node] = Field(
        default_factory=dict,
        description="the node that holds each leg, where the place of its end does not tell",
    )
