"""What the robot is, and how it stands at the pose."""

from __future__ import annotations

from robostiff.markup import Table, Words
from robostiff.model import Robot
from robostiff.model.in_words import elements_in_words, placed_in_words
from robostiff.plot.posed_robot import robot_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.report.section import Folded, Part, Section, section


def robot_section(contents: ReportContents) -> Section:
    """Source, legs, and a picture of the robot at the pose."""
    robot, snapshot = contents.robot, contents.snapshot
    parts: list[Part | None] = []
    if isinstance(robot, Robot):
        if robot.source:
            parts.append(Words(f"Source: {robot.source}"))
        free = ", ".join(coordinate.value for coordinate in robot.coordinates)
        if free:
            parts.append(Words(f"Free coordinates of the platform: {free}."))
        legs = [(leg.name, ", ".join(elements_in_words(leg.chain))) for leg in robot.legs]
    else:
        legs = [(leg.name, ", ".join(placed_in_words(leg))) for leg in robot.legs]
    if snapshot is not None:
        parts.append(one_figure("robot", "The robot at this pose.", robot_picture(snapshot)))
    whole = Table(["leg", "from base to platform"], legs)
    several = Folded(f"{len(legs)} legs, element by element", (whole,))
    parts.append(whole if len(legs) == 1 else several)
    return section("robot", "The robot", parts)
