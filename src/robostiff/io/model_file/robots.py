"""Robots of legs, and arms by a table of Denavit and Hartenberg, in model files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from robostiff.io.model_file.chains import WrittenLegs, build_legs
from robostiff.io.model_file.joints import WrittenLaw, WrittenOneAxisJoint
from robostiff.io.model_file.parts import (
    Direction,
    Pair,
    Text,
    Value,
    Vector,
    WrittenFrame,
    WrittenHead,
    WrittenMapping,
    WrittenMass,
    WrittenPlatformMass,
    build_gravity,
    build_platform_masses,
)
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.platform import WrittenBodySpring, WrittenPlatform, attached
from robostiff.io.model_file.stock import WrittenMaterial, WrittenSection, stocked
from robostiff.io.units import Dimension
from robostiff.model import (
    Coordinate,
    DHConvention,
    DHRow,
    Joint,
    Robot,
    pose_coordinates,
    serial_arm,
)
from robostiff.spatial import Space

if TYPE_CHECKING:
    from robostiff.io.model_file.machine import ModuleFiles


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

    def build(
        self, top: Place, files: ModuleFiles, holds: Sequence[str] = ()
    ) -> tuple[Robot, list[Place]]:
        """The robot, not yet verified, and the places of its legs.

        Nodes that hold the legs are found with numbers before formulas are built.
        """
        del files
        top = stocked(top, self.materials, self.sections)
        here = top / "platform"
        platform = None if self.platform is None else self.platform.build(here)
        legs = build_legs(top / "legs", self.legs)
        legs = attached(legs, platform, here, self.platform, holds)
        home = None if self.home is None else self.home.build(top / "home")
        if home is None and len(legs) > 1:
            raise (top / "home").error(
                "missing key",
                hint="home is the pose of the platform, for a robot with several legs; write "
                "home: {at: [0, 0, 800 mm]} or the like",
            )
        with top.complaints():
            robot = Robot(
                name=self.name,
                legs=tuple(leg for _, leg in legs),
                home=home,
                reference_point=(top / "reference_point").point(self.reference_point),
                coordinates=_coordinates(top / "coordinates", self),
                space=Space.PLANAR if self.planar else Space.SPATIAL,
                title=self.title,
                source=self.source,
                platform=platform,
                platform_masses=build_platform_masses(
                    top / "platform_masses", self.platform_masses
                ),
                gravity=build_gravity(top / "gravity", self.gravity),
                springs=tuple(own.build(top / "springs" / i) for i, own in enumerate(self.springs)),
            )
        return robot, [place for place, _ in legs]


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

    def build(self, place: Place) -> tuple[DHRow, Joint]:
        """The row, and its joint."""
        drive = {key: getattr(self, key) for key in ("type", "stiffness", "limits", "home")}
        joint = WrittenOneAxisJoint(**drive, role="actuated", axis="z").build(place, "")
        with place.complaints():
            row = DHRow(
                a=place.number_at(self, "a", Dimension.LENGTH),
                alpha=place.number_at(self, "alpha", Dimension.ANGLE),
                d=place.number_at(self, "d", Dimension.LENGTH),
                theta=place.number_at(self, "theta", Dimension.ANGLE),
                slides=self.type == "prismatic",
                name=self.name or "",
                masses=self.masses(place),
            )
        return row, joint


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
    laws: ClassVar[dict[str, WrittenLaw]] = {}

    def build(
        self, top: Place, files: ModuleFiles, holds: Sequence[str] = ()
    ) -> tuple[Robot, list[Place]]:
        """The arm of the table, not yet verified, and the place of its only leg."""
        del files, holds
        coordinates = _coordinates(top / "coordinates", self)
        place, table = top / "dh", self.dh
        built = [row.build(place / "joints" / i) for i, row in enumerate(table.joints)]
        rows, joints = zip(*built, strict=True)
        with place.complaints():
            arm = serial_arm(
                rows,
                convention=DHConvention(table.convention),
                joint_stiffness=[joint.role.stiffness for joint in joints],
                limits=[joint.role.limits for joint in joints],
                home=[joint.home[0] if joint.home_given else None for joint in joints],
                base=table.base.build(place / "base"),
                tool=None if table.tool is None else table.tool.build(place / "tool"),
                name=self.name,
                coordinates=coordinates,
                title=self.title,
                source=self.source,
            )
        arm = replace(
            arm,
            reference_point=(top / "reference_point").point(self.reference_point),
            platform_masses=build_platform_masses(top / "platform_masses", self.platform_masses),
            gravity=build_gravity(top / "gravity", self.gravity),
        )
        return arm, [place]


def _coordinates(place: Place, written: WrittenRobot | WrittenArm) -> tuple[Coordinate, ...]:
    if written.coordinates is None:
        if written.home is None:
            return ()  # a serial arm, posed by its joints
        return pose_coordinates(Space.PLANAR if written.planar else Space.SPATIAL)
    chosen = distinct_coordinates(place, written.coordinates)
    outside = [c for c in chosen if written.planar and c not in pose_coordinates(Space.PLANAR)]
    if outside:
        i = chosen.index(outside[0])
        raise (place / i).error(
            "coordinate of a planar robot", got=outside[0].value, expected="x, y or rz"
        )
    return chosen


def distinct_coordinates(place: Place, words: Sequence[str]) -> tuple[Coordinate, ...]:
    """The pose coordinates that are written at a place, each once."""
    chosen = tuple(Coordinate(word) for word in words)
    if len(set(chosen)) < len(chosen):
        raise place.error("coordinates", got=list(words), expected="each one once")
    return chosen
