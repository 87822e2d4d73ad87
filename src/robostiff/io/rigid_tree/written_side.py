"""The keys of a side file, and which joints and links its entries are about."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen
from pydantic import AfterValidator, Field, Tag

from robostiff.errors import FileError, InputError, Words
from robostiff.extras import READERS, added
from robostiff.io.document import Document, read_document
from robostiff.io.model_file.joints import WrittenJoint
from robostiff.io.model_file.links import (
    MaterialChoice,
    SectionChoice,
    Theory,
    WrittenMaterial,
    WrittenMatrices,
    WrittenSection,
    WrittenSegment,
    WrittenSpring,
)
from robostiff.io.model_file.place import (
    VERSION,
    Direction,
    Pair,
    Place,
    Text,
    Value,
    Vector,
    WordOr,
    WrittenFrame,
    WrittenMapping,
    check_version,
    either,
)

_LINK = "the name of a link"


class WrittenTreeJoint(WrittenMapping):
    """Role, stiffness and limits of a joint of the tree, and the spring beside its drive."""

    role: Literal["passive", "actuated", "locked"] | None = None
    stiffness: Value | None = None
    spring: Value | None = Field(
        default=None,
        description="stiffness of a spring beside the drive, in place of that of the description; "
        "0 for none",
    )
    limits: Pair | None = None
    inertia: Value | None = None


class WrittenLinkBeam(WrittenMapping):
    """A link that is a beam, from its joint to the next one."""

    type: Literal["beam"]
    to: Text | None = None
    y_axis: Direction | None = None
    material: MaterialChoice = Field(description="a name, such as steel, or {E: 70 GPa, ...}")
    section: SectionChoice | None = None
    theory: Theory = "euler-bernoulli"
    taper: Annotated[list[WrittenSegment], MinLen(1)] | None = None


class WrittenLinkMatrix(WrittenMatrices):
    """A link given by its 6x6 matrix, about the next joint."""

    type: Literal["link"]
    to: Text | None = None


WrittenElasticLink = Annotated[WrittenLinkBeam | WrittenLinkMatrix, Field(discriminator="type")]


class WrittenLinkFrame(WrittenFrame):
    """A frame on a link."""

    link: Text = Field(description=_LINK)


LinkFrameChoice = WordOr[WrittenLinkFrame]
"""A link, whose own frame it is, or a frame on a link."""


class WrittenTool(WrittenMapping):
    """The point whose stiffness is computed."""

    link: Text = Field(description=_LINK)
    at: Vector | None = None


def _loop_word(value: str) -> str:
    if value in ("fixed", "spherical"):
        return value
    raise InputError(
        "joint of the loop",
        got=value,
        expected="fixed, spherical, or a joint with its axis",
        hint="write joint: {type: revolute, axis: z, role: passive} or the like",
    )


LoopJointChoice = Annotated[
    Annotated[str, AfterValidator(_loop_word), Tag("word")]
    | Annotated[WrittenJoint | WrittenSpring, Field(discriminator="type"), Tag("mapping")],
    either(str, "word", "mapping"),
]


class WrittenLoop(WrittenMapping):
    """Frames on two links of the tree that coincide up to the motion of a joint."""

    name: Text | None = None
    between: Annotated[list[LinkFrameChoice], MinLen(2), MaxLen(2)] = Field(
        description="the two frames, such as [hand, part] or [{link: rod, at: [0.3, 0, 0]}, disc]"
    )
    joint: LoopJointChoice = Field(
        description="fixed, spherical, or a joint such as {type: revolute, axis: z, role: passive}"
    )


class WrittenSide(WrittenMapping):
    """A whole side file."""

    robostiff: Literal[1]
    robot: str | None = None
    name: Text | None = None
    title: str = ""
    source: Text = Field(description="where the stiffnesses come from, in a sentence")
    notes: str = ""
    parameters: dict[str, Value] = Field(default_factory=dict)
    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    base: Text | None = None
    platform: Text | None = None
    tool: WordOr[WrittenTool] | None = None
    joints: dict[str, WrittenTreeJoint] = Field(default_factory=dict)
    links: dict[str, WrittenElasticLink] = Field(default_factory=dict)
    loops: list[WrittenLoop] = Field(default_factory=list)
    home: dict[str, Any] = Field(default_factory=dict)
    start: dict[str, Any] = Field(default_factory=dict)
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None


def check_known(place: Place, name: str, what: str, known: Sequence[str]) -> str:
    """The name, when it is one of those known."""
    if name not in known:
        raise place.unknown(what, name, known, most=30)
    return name


_EXAMPLE = (
    "write robostiff: 1, source: where the numbers come from, tool: the name of a link, joints: "
    '{"*": {stiffness: 1e4 N m/rad}}, or the like'
)


def read_side(description: Path | str, side: Path | str | None = None) -> Document:
    """The side file of a robot description.

    Parameters
    ----------
    description : path or str
    side : path or str, optional
        The side file; the one beside the description when left out: ``arm.stiffness.yaml`` beside
        ``arm.urdf.xacro``.

    Raises
    ------
    InputError
        When there is none; a `FileError` when it cannot be read or is no side file.
    """
    if side is None:
        name = Path(description).name
        for ending in (".xacro", ".urdf", ".xml", *added(READERS)):
            name = name[: -len(ending)] if name.lower().endswith(ending) else name
        found = Path(description).with_name(f"{name}.stiffness.yaml")
        if not found.exists():
            raise InputError(
                f"stiffness of {str(description)!r}",
                got=Words("no side file"),
                expected=f"{found} beside it, or another file by side=, --side on the command line",
                hint=f"there {_EXAMPLE}",
            )
        side = found
    document = read_document(side)
    expected = f"robostiff: {VERSION} at the top"
    check_version(document, "side file", "version of the side file", expected, _EXAMPLE)
    if "legs" in document.data:
        raise FileError(
            document.key_location(("legs",)),
            "side file",
            got=Words("a model file with legs of its own"),
            expected="a side file of a robot description",
            hint=_EXAMPLE,
        )
    return document
