"""How copies of a leg or a branch are written in a model file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, StringConstraints, Tag

from robostiff.io.model_file.written_parts import Value, Written

Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class WrittenCount(Written):
    """Numbered copies: the variable is 1, 2, ... and the name has the same number."""

    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many copies there are")
    variable: Text = Field(description="the name of the variable that numbers the copies")
    name: Text | None = None


WrittenCopy = dict[str, Value]
"""The name of a copy and the values of its variables."""


def list_or_mapping(value: Any) -> str:
    """Which of the two a value is; for several of something, or one with ``repeat``."""
    return "list" if isinstance(value, list) else "mapping"


def one_or_pattern(value: Any) -> str:
    """Whether a mapping has the key ``repeat``."""
    return "pattern" if isinstance(value, dict) and "repeat" in value else "one"


class WrittenRepeat(Written):
    """What makes several of one: the copies, and the variables that differ."""

    repeat: Annotated[
        Annotated[list[WrittenCopy], Tag("list"), Field(min_length=1)]
        | Annotated[WrittenCount, Tag("mapping")],
        Discriminator(list_or_mapping),
    ] = Field(description="a list of copies, such as {name: leg1, phi: 0 deg}, or a count")
    let: dict[str, Value] = Field(default_factory=dict)
