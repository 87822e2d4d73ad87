"""Elements of a chain and flexible platforms as written in a model file."""

from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen
from pydantic import Field, Tag

from robostiff.io.model_file.joints import WrittenDrive, WrittenJoint
from robostiff.io.model_file.written_parts import (
    REPEATED,
    Direction,
    MaterialChoice,
    Name,
    SectionChoice,
    Theory,
    Value,
    Vector,
    WrittenCoupled,
    WrittenFrame,
    WrittenMapping,
    WrittenMass,
    WrittenRepeat,
    WrittenRotation,
    either,
)

_Six = Annotated[list[Any], MinLen(6), MaxLen(6)]
_MATERIAL = "a name, such as steel, or {E: 70 GPa, poisson_ratio: 0.33}"
_SECTION = "a name, or a shape such as {circle: {diameter: 20 mm}}"


class WrittenRigid(WrittenRotation, WrittenMass):
    """Rigid part."""

    type: Literal["rigid"]
    name: Name | None = None
    to: Vector | None = None


class WrittenSegment(WrittenMapping):
    """A uniform piece of a beam."""

    share: Value = Field(description="the part of the beam's length that this segment has")
    material: MaterialChoice | None = None
    section: SectionChoice = Field(description=_SECTION)


class WrittenBeam(WrittenMass):
    """Straight beam."""

    type: Literal["beam"]
    name: Name | None = None
    to: Vector = Field(description="the end of the beam, [x, y, z] in the present frame")
    y_axis: Direction | None = None
    material: MaterialChoice = Field(description=_MATERIAL)
    section: SectionChoice | None = None
    theory: Theory = "euler-bernoulli"
    taper: Annotated[list[WrittenSegment], Field(min_length=1)] | None = None


class WrittenMatrices(WrittenRotation):
    """A 6x6 stiffness or compliance: six lists of six numbers, or the six of the diagonal."""

    stiffness: _Six | None = None
    compliance: _Six | None = None


class WrittenSpring(WrittenMatrices, WrittenMass):
    """Spring at one place of the chain."""

    type: Literal["spring"]
    name: Name | None = None
    at: Vector | None = None


class WrittenLink(WrittenMatrices, WrittenMass):
    """Elastic part given by its 6x6 matrix."""

    type: Literal["link"]
    name: Name | None = None
    to: Vector = Field(description="the far end, [x, y, z] in the present frame")


class WrittenTelescopicBeam(WrittenMapping):
    """A beam that a telescope lengthens."""

    share: Value | None = None
    fixed: Value = 0.0
    material: MaterialChoice = Field(description=_MATERIAL)
    section: SectionChoice = Field(description=_SECTION)
    theory: Theory = "euler-bernoulli"
    mass: Value | None = None


class WrittenTelescope(WrittenDrive):
    """Leg of variable length."""

    type: Literal["telescope"]
    direction: Direction = Field(description="the direction of the slide, such as z")
    y_axis: Direction | None = None
    home: Value | None = None
    beams: list[WrittenTelescopicBeam] = Field(default_factory=list)


class WrittenParallelogram(WrittenCoupled):
    """Two copies of a bar with its joints, side by side."""

    type: Literal["parallelogram"]
    name: Name | None = None
    across: Vector = Field(description="from the first bar to the second, such as [0, 80 mm, 0]")
    chain: Annotated["list[WrittenElement]", MinLen(1)] = Field(
        description="the list of elements of one bar, its joints included"
    )


class WrittenBranchBody(WrittenCoupled):
    """Common keys of a branch and of the template of repeated branches."""

    start: WrittenFrame = WrittenFrame()
    chain: Annotated["list[WrittenElement]", MinLen(1)] = Field(
        description="the list of elements from the body before the block to the body after it"
    )
    end: WrittenFrame = WrittenFrame()


class WrittenBranch(WrittenBranchBody):
    """One branch."""

    name: Name = Field(description="the name of the branch")


class WrittenBranchPattern(WrittenRepeat, WrittenBranchBody):
    """A branch, and what differs from copy to copy."""


BranchOrPattern = Annotated[
    Annotated[WrittenBranch, Tag("one")] | Annotated[WrittenBranchPattern, Tag("pattern")], REPEATED
]


class WrittenParallel(WrittenMapping):
    """Branches side by side between two bodies of a chain."""

    type: Literal["parallel"]
    name: Name | None = None
    branches: Annotated[
        Annotated[list[BranchOrPattern], Tag("list"), MinLen(1)]
        | Annotated[WrittenBranchPattern, Tag("mapping")],
        either(list, "list", "mapping"),
    ] = Field(description="a list of branches, or one branch with repeat:")


WrittenElement = Annotated[
    WrittenJoint
    | WrittenRigid
    | WrittenBeam
    | WrittenSpring
    | WrittenLink
    | WrittenTelescope
    | WrittenParallelogram
    | WrittenParallel,
    Field(discriminator="type"),
]


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
