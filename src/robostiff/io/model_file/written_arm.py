"""A serial arm as a table of Denavit and Hartenberg in a model file."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robostiff.io.model_file.written_parts import (
    Pair,
    Text,
    Value,
    Vector,
    Written,
    WrittenFrame,
    WrittenHead,
)


class WrittenDHRow(Written):
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


class WrittenDH(Written):
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
    dh: WrittenDH = Field(description="convention, and a row for each joint")
    planar: ClassVar[bool] = False
    home: ClassVar[None] = None
