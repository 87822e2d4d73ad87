"""Parts of model files: values, frames, materials, cross-sections, copies, couplings, heads."""

from typing import Annotated, Any, Literal

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
Vector = Annotated[list[Value], MinLen(3), MaxLen(3)]
Pair = Annotated[list[Value], MinLen(2), MaxLen(2)]

AxisWord = Literal["x", "y", "z", "-x", "-y", "-z"]


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


class WrittenMaterial(WrittenMapping):
    """A material: E with G, or E with the Poisson ratio."""

    E: Value = Field(description="Young's modulus")
    G: Value | None = None
    poisson_ratio: Value | None = None
    density: Value | None = None
    source: str = ""


class WrittenCircle(WrittenMapping):
    """Full circle."""

    diameter: Value


class WrittenTube(WrittenMapping):
    """Circular tube."""

    outer_diameter: Value
    inner_diameter: Value


class WrittenRectangle(WrittenMapping):
    """Full rectangle."""

    width_y: Value
    height_z: Value


class WrittenBox(WrittenMapping):
    """Hollow rectangle."""

    width_y: Value
    height_z: Value
    wall: Value


class WrittenISection(WrittenMapping):
    """Flanges along y, web along z."""

    flange_width: Value
    height: Value
    web_thickness: Value
    flange_thickness: Value


class WrittenProperties(WrittenMapping):
    """The numbers themselves."""

    A: Value
    Iy: Value
    Iz: Value
    J: Value
    shear_factor_y: Value | None = None
    shear_factor_z: Value | None = None


class WrittenSection(WrittenMapping):
    """A cross-section: exactly one of these shapes."""

    circle: WrittenCircle | None = None
    tube: WrittenTube | None = None
    rectangle: WrittenRectangle | None = None
    box: WrittenBox | None = None
    i: WrittenISection | None = None
    properties: WrittenProperties | None = None


MaterialChoice = Annotated[
    Annotated[str, Tag("name")] | Annotated[WrittenMaterial, Tag("mapping")],
    either(str, "name", "mapping"),
]
SectionChoice = Annotated[
    Annotated[str, Tag("name")] | Annotated[WrittenSection, Tag("mapping")],
    either(str, "name", "mapping"),
]
Theory = Literal["euler-bernoulli", "timoshenko"]


Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


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


class WrittenFollower(WrittenMapping):
    """A joint that follows another one: a gear, belt, rack or mimic joint."""

    name: Name | None = None
    joint: Name = Field(description="the joint that follows, such as wrist2; it is passive")
    follows: Name = Field(description="the joint that it follows, such as wrist1")
    ratio: Value = Field(
        description="how far it moves for one of the other, such as -1.5; of a slide that follows "
        "a turn the length for one radian"
    )
    offset: Value = Field(0, description="its coordinate where the other one is 0")
    stiffness: Value | None = Field(
        None, description="of the belt or gear, felt at the joint that follows; rigid if left out"
    )


class WrittenSum(WrittenMapping):
    """A sum of joint coordinates that is held, or moved by a drive: a differential."""

    name: Name | None = None
    sum: Annotated[dict[Name, Value], Field(min_length=2)] = Field(
        description="joints with their factors, such as {roll: 1, pitch: -1}"
    )
    equals: Value | None = Field(
        None, description="the value of the sum; that of the home configuration if left out"
    )
    role: Literal["locked", "actuated"] = Field(
        "locked", description="locked, or actuated where a drive moves the sum"
    )
    stiffness: Value | None = Field(None, description="against the sum; rigid if left out")
    limits: Pair | None = Field(None, description="lowest and highest sum of an actuated one")


WrittenCoupling = Annotated[
    Annotated[WrittenFollower, Tag("follower")] | Annotated[WrittenSum, Tag("sum")],
    with_key("sum", "sum", "follower"),
]
_Couplings = Annotated[
    list[WrittenCoupling],
    Field(
        default_factory=list,
        description="gears and differentials between joints of the chain, such as "
        "[{joint: wrist2, follows: wrist1, ratio: -1.5}]",
    ),
]


class WrittenCoupled(WrittenMapping):
    """The keys of what has a chain, whose joints may be coupled."""

    chain: Any
    couplings: _Couplings


class WrittenHead(WrittenMapping):
    """Name, source and parameters of a robot."""

    robostiff: Literal[1]
    name: Text = Field(description="the name of the robot")
    title: str = ""
    source: Text = Field(description="where the numbers come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)
