"""Parts of model files: values, frames, masses, copies, heads."""

from typing import Annotated, Any, Literal, TypeVar

from annotated_types import MaxLen, MinLen
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    StringConstraints,
    Tag,
    WithJsonSchema,
)

from robostiff.errors import InputError
from robostiff.io.suggest import shown


class WrittenMapping(BaseModel):
    """A mapping in a model file: its keys and no others, kept as they were written."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


def either(kind: type, tag: str, other: str) -> Discriminator:
    """Members of a union that differ in the kind of what is written."""
    return Discriminator(lambda value: tag if isinstance(value, kind) else other)


def with_key(key: str, tag: str, other: str) -> Discriminator:
    """Mappings that differ in a key."""
    return Discriminator(lambda value: tag if isinstance(value, dict) and key in value else other)


#: One of something, or a pattern of several.
REPEATED = with_key("repeat", "pattern", "one")


def _value(value: Any) -> Any:
    if isinstance(value, (str, int, float)) and not isinstance(value, bool):
        return value
    raise InputError(
        "wrong value", got=shown(value), expected="a number, or a text such as 300 mm or 2*R"
    )


Value = Annotated[Any, PlainValidator(_value), WithJsonSchema({"type": ["number", "string"]})]
"""A number in SI units, or an expression."""

Name = Annotated[str, Field(min_length=1)]
Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Vector = Annotated[list[Value], MinLen(3), MaxLen(3)]
Pair = Annotated[list[Value], MinLen(2), MaxLen(2)]

AxisWord = Literal["x", "y", "z", "-x", "-y", "-z"]


Mapped = TypeVar("Mapped", bound=WrittenMapping)
WordOr = Annotated[
    Annotated[Text, Tag("word")] | Annotated[Mapped, Tag("mapping")],
    either(str, "word", "mapping"),
]
"""A name, or what it would stand for."""

Direction = Annotated[
    Annotated[AxisWord, Tag("word")] | Annotated[Vector, Tag("vector")],
    either(str, "word", "vector"),
]
"""An axis of the present frame by name, or three numbers; its length does not matter."""


class WrittenTurn(WrittenMapping):
    """A turn about one current axis; exactly one of the three is written."""

    x: Value | None = None
    y: Value | None = None
    z: Value | None = None


class WrittenAxes(WrittenMapping):
    """The directions of two axes of a frame; the third follows by the right hand."""

    x: Direction | None = None
    y: Direction | None = None
    z: Direction | None = None


class WrittenRotation(WrittenMapping):
    """A rotation, in at most one of four ways."""

    turn: list[WrittenTurn] | None = None
    rotation_vector: Vector | None = None
    matrix: Annotated[list[Vector], MinLen(3), MaxLen(3)] | None = None
    axes: WrittenAxes | None = None


class WrittenFrame(WrittenRotation):
    """A frame: where its origin is, and how its axes are turned."""

    at: Vector | None = None


class WrittenMass(WrittenMapping):
    """Mass of a part, and where it is."""

    mass: Value | None = None
    centre: Vector | None = None


class WrittenCount(WrittenMapping):
    """Numbered copies: the variable is 1, 2, ... and the name has the same number."""

    count: Annotated[int, Field(ge=1, le=1000)] = Field(description="how many copies there are")
    variable: Text = Field(description="the name of the variable that numbers the copies")
    name: Text | None = None


WrittenCopy = dict[str, Value]
"""The name of a copy and the values of its variables."""


class WrittenRepeat(WrittenMapping):
    """Copies of a leg or branch: the list or number of copies, and their variables."""

    repeat: Annotated[
        Annotated[list[WrittenCopy], Tag("list"), Field(min_length=1)]
        | Annotated[WrittenCount, Tag("mapping")],
        either(list, "list", "mapping"),
    ] = Field(description="a list of copies, such as {name: leg1, phi: 0 deg}, or a count")
    let: dict[str, Value] = Field(default_factory=dict)


One = TypeVar("One", bound=WrittenMapping)

Pattern = TypeVar("Pattern", bound=WrittenMapping)

_OneOrPattern = Annotated[Annotated[One, Tag("one")] | Annotated[Pattern, Tag("pattern")], REPEATED]

OneOrSeveral = Annotated[
    Annotated[list[_OneOrPattern[One, Pattern]], Tag("list"), Field(min_length=1)]
    | Annotated[Pattern, Tag("mapping")],
    either(list, "list", "mapping"),
]
"""A list in which patterns stand for several, or one pattern alone."""


class WrittenHead(WrittenMapping):
    """Name, source and parameters of a robot."""

    robostiff: Literal[1]
    name: Text = Field(description="the name of the robot")
    title: str = ""
    source: Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)
