"""Cable robots: what may be written of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field

from robostiff.frozen import replace
from robostiff.io.model_file.chains import OneOrSeveral, WrittenRepeat, each_of
from robostiff.io.model_file.place import (
    Force,
    Length,
    Number,
    Place,
    Stiffness,
    Text,
    Vector,
    WrittenFrame,
    WrittenHead,
    WrittenMapping,
)
from robostiff.io.units import Dimension
from robostiff.model.cable import Cable, CableRobot, Weight
from robostiff.spatial import Space


class WrittenCableBody(WrittenMapping):
    """Common keys of a cable and of the template of repeated cables."""

    exit: Vector = Field(description="where the cable leaves the base, in the world")
    platform: Vector = Field(description="where it meets the platform, in the platform frame")
    EA: Force | None = None
    guide_length: Length = 0
    winch_stiffness: Stiffness | None = None
    least_tension: Force | None = None
    greatest_tension: Force | None = None
    tension: Force | None = None

    def build(self, place: Place, name: str, limits: Mapping[str, Any]) -> Cable:
        """The cable; limits that it does not have are those of all cables."""
        numbers = self.numbers(place)
        for key in ("least", "greatest"):
            tension = numbers[f"{key}_tension"]
            numbers[f"{key}_tension"] = limits[key] if tension is None else tension
        exit_point = (place / "exit").point(self.exit)
        attachment = (place / "platform").point(self.platform)
        with place.complaints():
            return Cable(name, exit_point, attachment, **numbers)


class WrittenCable(WrittenCableBody):
    """One cable."""

    name: Text = Field(description="the name of the cable")


class WrittenCablePattern(WrittenCableBody, WrittenRepeat):
    """A cable, and what differs from copy to copy."""


WrittenCables = OneOrSeveral[WrittenCable, WrittenCablePattern]


class WrittenWeight(WrittenMapping):
    """A force of constant direction in the world, at a point of the platform."""

    force: Vector
    at: Vector | None = None

    def build(self, place: Place) -> Weight:
        """The weight."""
        force = (place / "force").vector(self.force, Dimension.FORCE)
        return Weight(force, (place / "at").point(self.at))


class WrittenTensionLimits(WrittenMapping):
    """Limits of the tension of every cable that has none of its own, and the aim between them."""

    least: Force = 0
    greatest: Force | None = None
    level: Number = 0


class WrittenCableRobot(WrittenHead):
    """A whole model file of a cable robot."""

    planar: bool = False
    home: WrittenFrame = Field(description="the pose of the platform, such as {at: [0, 0, 2 m]}")
    reference_point: Vector | None = None
    weight: WrittenWeight | None = None
    tensions: WrittenTensionLimits = WrittenTensionLimits()
    cables: WrittenCables = Field(description="a list of cables, or one cable with repeat:")

    def build(self, top: Place, _holds: object) -> tuple[CableRobot, list[Place]]:
        """The cable robot, and no places of legs."""
        weight = None if self.weight is None else self.weight.build(top / "weight")
        tensions = self.tensions.numbers(top / "tensions")
        limits = tensions if tensions["greatest"] is not None else {**tensions, "greatest": np.inf}
        with top.complaints():
            robot = CableRobot(
                name=self.name,
                cables=tuple(
                    part.build(here, name, limits)
                    for name, here, part in each_of(top / "cables", self.cables, "cable")
                ),
                home=self.home.build(top / "home"),
                weight=weight,
                reference_point=(top / "reference_point").point(self.reference_point),
                space=Space.PLANAR if self.planar else Space.SPATIAL,
                title=self.title,
                source=self.source,
            )
        with (top / "tensions" / "level").complaints():
            return replace(robot, tension_level=limits["level"]), []
