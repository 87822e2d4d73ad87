"""How robots and legs are written in a model file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from robostiff.io.model_file.written_elements import WrittenElement
from robostiff.io.model_file.written_head import WrittenHead
from robostiff.io.model_file.written_parts import (
    Vector,
    Written,
    WrittenFrame,
    WrittenMaterial,
    WrittenSection,
)
from robostiff.io.model_file.written_platform import WrittenAttachment, WrittenPlatform
from robostiff.io.model_file.written_repeat import (
    Text,
    WrittenRepeat,
    list_or_mapping,
    one_or_pattern,
)

VERSION = 1
"""Of the file format."""


class WrittenLegBody(Written):
    """What a leg and the template of repeated legs have in common."""

    base: WrittenFrame = WrittenFrame()
    chain: Annotated[list[WrittenElement], Field(min_length=1)] = Field(
        description="the list of elements from base to platform"
    )
    platform: WrittenAttachment = WrittenAttachment()
    elbow: Literal["home", "plus", "minus"] = "home"


class WrittenLeg(WrittenLegBody):
    """One leg."""

    name: Text = Field(description="what the leg is called")


class WrittenPattern(WrittenRepeat, WrittenLegBody):
    """A leg, and what differs from copy to copy."""


_LegOrPattern = Annotated[
    Annotated[WrittenLeg, Tag("one")] | Annotated[WrittenPattern, Tag("pattern")],
    Discriminator(one_or_pattern),
]

WrittenLegs = Annotated[
    Annotated[list[_LegOrPattern], Tag("list"), Field(min_length=1)]
    | Annotated[WrittenPattern, Tag("mapping")],
    Discriminator(list_or_mapping),
]


class WrittenRobot(WrittenHead):
    """A whole model file."""

    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    planar: bool = False
    home: WrittenFrame | None = None
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform: WrittenPlatform | None = None
    legs: WrittenLegs = Field(description="a list of legs, or one leg with repeat:")
