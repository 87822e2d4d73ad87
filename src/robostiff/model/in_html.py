"""A robot in HTML, as notebooks show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robostiff.markup import Table, block_html, element, escaped
from robostiff.model.in_words import elements_in_words

if TYPE_CHECKING:
    from robostiff.model.robot import Robot


def robot_html(robot: Robot) -> str:
    """What a robot is: title, source, symbols, and the elements of its legs."""
    title = f": {escaped(robot.title)}" if robot.title else ""
    parts = [element("p", element("b", escaped(robot.name)) + title)]
    if robot.symbols:
        names = ", ".join(map(str, robot.symbols))
        parts.append(element("p", f"symbols: {escaped(names)}"))
    rows = [[leg.name, ", ".join(elements_in_words(leg.chain))] for leg in robot.legs]
    parts.append(block_html(Table(["leg", "from base to platform"], rows)))
    if robot.coordinates:
        free = " ".join(coordinate.value for coordinate in robot.coordinates)
        parts.append(element("p", f"free coordinates: {free}"))
    if robot.source:
        parts.append(element("p", element("small", escaped(robot.source))))
    return element("div", "".join(parts), class_="robostiff-robot")
