"""Model files as they are written: robots of legs, arms by a table, hybrid machines."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robostiff.errors import FileError
from robostiff.io.document import Document
from robostiff.io.model_file.build_chain import WrittenCoupled, WrittenElement, WrittenLegs
from robostiff.io.model_file.build_link import WrittenPlatformMass
from robostiff.io.model_file.build_platform import (
    WrittenBodySpring,
    WrittenPlatform,
)
from robostiff.io.model_file.joints import WrittenLaw
from robostiff.io.model_file.stock import WrittenMaterial, WrittenSection
from robostiff.io.model_file.written_parts import (
    Direction,
    Pair,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenHead,
    WrittenMapping,
    WrittenMass,
)
from robostiff.io.suggest import Words
from robostiff.io.validation import validate

VERSION = 1
"""Of the file format."""


class WrittenRobot(WrittenHead):
    """A whole model file."""

    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    planar: bool = False
    home: WrittenFrame | None = None
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform: WrittenPlatform | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)
    gravity: Direction | None = None
    springs: list[WrittenBodySpring] = Field(default_factory=list)
    laws: dict[str, WrittenLaw] = Field(default_factory=dict)
    legs: WrittenLegs = Field(description="a list of legs, or one leg with repeat:")


class WrittenModule(WrittenCoupled):
    """A module of a hybrid machine: a robot by its name or file, a chain, or legs."""

    name: Text = Field(description="the name of the module, with which those of its parts begin")
    mount: WrittenFrame | None = None
    robot: Text | None = Field(
        None, description="a shipped robot, or a model file as seen from this one"
    )
    parameters: dict[str, Value] = Field(
        default_factory=dict, description="other values for parameters of that robot"
    )
    chain: Annotated[list[WrittenElement], Field(min_length=1)] | None = None
    legs: WrittenLegs | None = None
    home: WrittenFrame | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)


class WrittenMachine(WrittenHead):
    """A whole model file of a hybrid machine, of modules in series."""

    materials: dict[str, WrittenMaterial] = Field(default_factory=dict)
    sections: dict[str, WrittenSection] = Field(default_factory=dict)
    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)
    gravity: Direction | None = None
    modules: Annotated[list[WrittenModule], Field(min_length=1, max_length=50)] = Field(
        description="the modules from base to tool, such as {name: arm, robot: scara}"
    )


def check_version(
    document: Document,
    what: str = "model file",
    subject: str = "version of the model file format",
    expected: str = f"robostiff: {VERSION} at the top, the version of the format",
    hint: str | None = None,
) -> None:
    """Raise unless a document begins with the version of its format."""
    data = document.data
    if not isinstance(data, dict) or "robostiff" not in data:
        raise FileError(document.location(), what, expected=expected, hint=hint)
    version = data["robostiff"]
    if version != VERSION or isinstance(version, bool):
        newer = isinstance(version, int) and version > VERSION
        raise FileError(
            document.location(("robostiff",)),
            subject,
            got=version,
            expected=str(VERSION),
            hint="this file needs a newer robostiff" if newer else None,
        )


class WrittenDHRow(WrittenMass):
    """A row of the table: the joint, and the link that goes with it."""

    name: Text | None = None
    type: Literal["revolute", "prismatic"] = "revolute"
    a: Value = 0
    alpha: Value = 0
    d: Value = 0
    theta: Value = 0
    stiffness: Value | None = None
    limits: Pair | None = None
    home: Value | None = None


class WrittenDH(WrittenMapping):
    """A table of Denavit and Hartenberg, with the frames at its ends."""

    convention: Literal["standard", "modified"] = Field(
        description="standard (Rz Tz Tx Rx) or modified (Rx Tx Rz Tz, after Craig)"
    )
    base: WrittenFrame = WrittenFrame()
    joints: Annotated[list[WrittenDHRow], Field(min_length=1, max_length=200)] = Field(
        description="a row for each joint, such as {a: 0, alpha: 90 deg, d: 89 mm, "
        "stiffness: 2e4 N m/rad}"
    )
    tool: WrittenFrame | None = None


class WrittenArm(WrittenHead):
    """A whole model file of a serial arm."""

    coordinates: list[Literal["x", "y", "z", "rx", "ry", "rz"]] | None = None
    reference_point: Vector | None = None
    platform_masses: list[WrittenPlatformMass] = Field(default_factory=list)
    gravity: Direction | None = None
    dh: WrittenDH = Field(description="convention, and a row for each joint")
    planar: ClassVar[bool] = False
    home: ClassVar[None] = None


WrittenModel = WrittenRobot | WrittenArm | WrittenMachine

#: What describes a robot, the key that shows it, and what to write instead of two of them.
_KINDS = {
    "dh": (
        WrittenArm,
        "a table describes a serial arm as a whole; write its elements as a leg to add elastic "
        "links",
    ),
    "modules": (WrittenMachine, "legs beside other modules are a module of their own"),
}


def written_model(document: Document) -> WrittenModel:
    """A model file as it is written: a robot of legs, an arm by its table, or a hybrid machine."""
    check_version(document)
    for key, (kind, hint) in _KINDS.items():
        if key in document.data:
            if "legs" in document.data:
                raise FileError(
                    document.key_location(("legs",)),
                    "legs",
                    got=Words(f"legs beside {key}"),
                    expected="one of them",
                    hint=hint,
                )
            return validate(kind, document)
    return validate(WrittenRobot, document)
