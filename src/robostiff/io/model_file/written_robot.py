"""How robots and legs are written in a model file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StringConstraints, Tag

from robostiff.io.model_file.written_elements import WrittenElement
from robostiff.io.model_file.written_parts import (
    Value,
    Vector,
    Written,
    WrittenFrame,
    WrittenMaterial,
    WrittenSection,
)

VERSION = 1
"""Of the file format."""

_Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class WrittenLegBody(Written):
    """What a leg and the template of repeated legs have in common."""

    base: WrittenFrame = WrittenFrame()
    chain: Annotated[list[WrittenElement], Field(min_length=1)] = Field(
        description="the list of elements from base to platform"
    )
    platform: WrittenFrame = WrittenFrame()
    elbow: Literal["home", "plus", "minus"] = "home"


class WrittenLeg(WrittenLegBody):
    """One leg."""

    name: _Text = Field(description="what the leg is called")


class WrittenCount(Written):
    """Numbered copies of a leg: the variable is 1, 2, ... and the name has the same number."""

    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many copies there are")
    variable: _Text = Field(description="the name of the variable that numbers the copies")
    name: _Text = "leg"


WrittenCopy = dict[str, Value]
"""The name of a copy and the values of its variables."""


def _list_or_mapping(value: Any) -> str:
    return "list" if isinstance(value, list) else "mapping"


class WrittenPattern(WrittenLegBody):
    """A leg, and what differs from copy to copy."""

    repeat: Annotated[
        Annotated[list[WrittenCopy], Tag("list"), Field(min_length=1)]
        | Annotated[WrittenCount, Tag("mapping")],
        Discriminator(_list_or_mapping),
    ] = Field(description="a list of copies, such as {name: leg1, phi: 0 deg}, or a count")
    let: dict[str, Value] = Field(default_factory=dict)


def _leg_or_pattern(value: Any) -> str:
    return "pattern" if isinstance(value, dict) and "repeat" in value else "leg"


_LegOrPattern = Annotated[
    Annotated[WrittenLeg, Tag("leg")] | Annotated[WrittenPattern, Tag("pattern")],
    Discriminator(_leg_or_pattern),
]

WrittenLegs = Annotated[
    Annotated[list[_LegOrPattern], Tag("list"), Field(min_length=1)]
    | Annotated[WrittenPattern, Tag("mapping")],
    Discriminator(_list_or_mapping),
]


class WrittenRobot(Written):
    """A whole model file."""

    robostiff: Literal[1]
    name: _Text = Field(description="what the robot is called")
    title: str = ""
    source: _Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)
    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    planar: bool = False
    home: WrittenFrame | None = None
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    legs: WrittenLegs = Field(description="a list of legs, or one leg with repeat:")
