"""What the robot is, and how it stands at the pose."""

from __future__ import annotations

from robostiff.markup import element, escaped, table
from robostiff.model import Robot
from robostiff.model.in_html import elements_in_words
from robostiff.plot.posed_robot import robot_picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import one_figure
from robostiff.report.section import Section, section


def robot_section(contents: ReportContents) -> Section:
    """Source, legs, and a picture of the robot at the pose."""
    robot, snapshot = contents.robot, contents.snapshot
    parts: list[object] = []
    if isinstance(robot, Robot):
        if robot.source:
            parts.append(element("p", f"Source: {escaped(robot.source)}"))
        free = " ".join(coordinate.value for coordinate in robot.coordinates)
        if free:
            parts.append(element("p", f"Its pose is told by {escaped(free)}."))
        legs = [(leg.name, ", ".join(elements_in_words(leg.chain))) for leg in robot.legs]
    else:
        legs = [(leg.name, ", ".join(part.name for part in leg.parts)) for leg in robot.legs]
    if snapshot is not None:
        caption = "The robot at this pose; turn it with the mouse."
        parts.append(one_figure("robot", caption, robot_picture(snapshot)))
    rows = [[escaped(name), escaped(words)] for name, words in legs]
    whole = table(["leg", "from base to platform"], rows)
    if len(rows) > 1:
        title = element("summary", f"{len(rows)} legs, element by element")
        whole = element("details", title + element("div", whole, class_="wide"))
    return section("robot", "The robot", *parts, whole)
