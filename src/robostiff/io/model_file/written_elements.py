"""Elements of a chain and flexible platforms as written in a model file."""

from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen
from pydantic import Discriminator, Field, Tag

from robostiff.io.model_file.written_parts import (
    Direction,
    MaterialChoice,
    Pair,
    SectionChoice,
    Theory,
    Value,
    Vector,
    Written,
    WrittenFrame,
    WrittenMass,
    WrittenRepeat,
    WrittenRotation,
    list_or_mapping,
    one_or_pattern,
)

_Six = Annotated[list[Any], MinLen(6), MaxLen(6)]
_Name = Annotated[str, Field(min_length=1)]
_MATERIAL = "a name, such as steel, or {E: 70 GPa, poisson_ratio: 0.33}"
_SECTION = "a name, or a shape such as {circle: {diameter: 20 mm}}"


class WrittenDrive(Written):
    """Common keys of joints and telescopes: role, stiffness, limits and home."""

    name: _Name | None = None
    role: Literal["passive", "actuated", "locked"] = Field(
        description="passive, actuated or locked"
    )
    stiffness: Value | None = None
    limits: Pair | None = None


class WrittenOneAxisJoint(WrittenDrive):
    """Revolute or prismatic joint."""

    type: Literal["revolute", "prismatic"]
    axis: Direction = Field(description="the axis, such as z or [0, 0, 1]")
    home: Value | None = None


class WrittenHelical(WrittenDrive):
    """Helical joint."""

    type: Literal["helical"]
    axis: Direction = Field(description="the axis, such as z or [0, 0, 1]")
    pitch: Value = Field(
        description="the advance along the axis in one full turn, such as 5 mm; negative for a "
        "left-handed screw"
    )
    home: Value | None = None


class WrittenUniversal(WrittenDrive):
    """Universal joint."""

    type: Literal["universal"]
    axes: Annotated[list[Direction], Field(min_length=2, max_length=2)] = Field(
        description="the two axes, such as [x, y], the one at the base side first"
    )
    home: Pair | None = None


class WrittenSpherical(WrittenDrive):
    """Spherical joint."""

    type: Literal["spherical"]
    home: Vector | None = None


class WrittenCylindrical(WrittenDrive):
    """Cylindrical joint."""

    type: Literal["cylindrical"]
    axis: Direction = Field(description="the axis, such as z or [0, 0, 1]")
    home: Pair | None = None


class WrittenPlanar(WrittenDrive):
    """Planar joint."""

    type: Literal["planar"]
    normal: Direction = Field(description="the direction across the plane, such as z")
    home: Vector | None = None


WrittenJoint = (
    WrittenOneAxisJoint
    | WrittenHelical
    | WrittenUniversal
    | WrittenSpherical
    | WrittenCylindrical
    | WrittenPlanar
)


class WrittenRigid(WrittenRotation, WrittenMass):
    """Rigid part."""

    type: Literal["rigid"]
    name: _Name | None = None
    to: Vector | None = None


class WrittenSegment(Written):
    """A uniform piece of a beam."""

    share: Value = Field(description="the part of the beam's length that this segment has")
    material: MaterialChoice | None = None
    section: SectionChoice = Field(description=_SECTION)


class WrittenBeam(WrittenMass):
    """Straight beam."""

    type: Literal["beam"]
    name: _Name | None = None
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
    name: _Name | None = None
    at: Vector | None = None


class WrittenLink(WrittenMatrices, WrittenMass):
    """Elastic part given by its 6x6 matrix."""

    type: Literal["link"]
    name: _Name | None = None
    to: Vector = Field(description="the far end, [x, y, z] in the present frame")


class WrittenTelescopicBeam(Written):
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


class WrittenFollower(Written):
    """A joint that follows another one: a gear, belt, rack or mimic joint."""

    name: _Name | None = None
    joint: _Name = Field(description="the joint that follows, such as wrist2; it is passive")
    follows: _Name = Field(description="the joint that it follows, such as wrist1")
    ratio: Value = Field(
        description="how far it moves for one of the other, such as -1.5; of a slide that follows "
        "a turn the length for one radian"
    )
    offset: Value = Field(0, description="its coordinate where the other one is 0")
    stiffness: Value | None = Field(
        None, description="of the belt or gear, felt at the joint that follows; rigid if left out"
    )


class WrittenSum(Written):
    """A sum of joint coordinates that is held, or moved by a drive: a differential."""

    name: _Name | None = None
    sum: Annotated[dict[_Name, Value], Field(min_length=2)] = Field(
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


def _sum_or_follower(value: Any) -> str:
    return "sum" if isinstance(value, dict) and "sum" in value else "follower"


WrittenCoupling = Annotated[
    Annotated[WrittenFollower, Tag("follower")] | Annotated[WrittenSum, Tag("sum")],
    Discriminator(_sum_or_follower),
]
_Couplings = Annotated[
    list[WrittenCoupling],
    Field(
        default_factory=list,
        description="gears and differentials between joints of the chain, such as "
        "[{joint: wrist2, follows: wrist1, ratio: -1.5}]",
    ),
]


class WrittenCoupled(Written):
    """The key of what has a chain whose joints may be coupled."""

    couplings: _Couplings


class WrittenParallelogram(WrittenCoupled):
    """Two copies of a bar with its joints, side by side."""

    type: Literal["parallelogram"]
    name: _Name | None = None
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

    name: _Name = Field(description="the name of the branch")


class WrittenBranchPattern(WrittenRepeat, WrittenBranchBody):
    """A branch, and what differs from copy to copy."""


BranchOrPattern = Annotated[
    Annotated[WrittenBranch, Tag("one")] | Annotated[WrittenBranchPattern, Tag("pattern")],
    Discriminator(one_or_pattern),
]


class WrittenParallel(Written):
    """Branches side by side between two bodies of a chain."""

    type: Literal["parallel"]
    name: _Name | None = None
    branches: Annotated[
        Annotated[list[BranchOrPattern], Tag("list"), MinLen(1)]
        | Annotated[WrittenBranchPattern, Tag("mapping")],
        Discriminator(list_or_mapping),
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


_Node = Annotated[str, Field(min_length=1)]
_Between = Annotated[list[_Node], Field(min_length=2, max_length=2)]


class WrittenAttachment(WrittenFrame):
    """Where a leg meets the platform: a frame of it, or a node of a flexible platform."""

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
    """A flexible platform."""

    nodes: Annotated[dict[_Node, Vector], Field(min_length=2)] = Field(
        description="names and places, such as {hub: [0, 0, 0], rim: [r, 0, 0]}"
    )
    beams: list[WrittenPlatformBeam] = Field(default_factory=list)
    springs: list[WrittenPlatformSpring] = Field(default_factory=list)
    rigid: list[WrittenMember] = Field(default_factory=list)
    tool: _Node = Field(description="the node that carries the reference point")
    legs: dict[str, _Node] = Field(
        default_factory=dict,
        description="the node that holds each leg, where the position of its end is ambiguous",
    )
