"""A robot in HTML, as notebooks show it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from robostiff.markup import Table, block_html, element, escaped
from robostiff.model.joint import Actuated, Joint, Locked
from robostiff.model.link import Telescope
from robostiff.model.parallel_block import ParallelBlock

if TYPE_CHECKING:
    from robostiff.model.chain import Chain, Element
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


def elements_in_words(chain: Chain) -> Iterator[str]:
    """The elements of a chain by name, with who holds its joints and what is in its blocks."""
    return map(_in_words, chain.elements)


def _in_words(part: Element) -> str:
    if isinstance(part, ParallelBlock):
        branches = (
            f"{branch.name}: {', '.join(elements_in_words(branch.chain))}"
            for branch in part.branches
        )
        return f"{part.name} ({'; '.join(branches)})"
    if isinstance(part, Joint | Telescope):
        held = {Actuated: "actuated", Locked: "locked"}.get(type(part.role), "passive")
        return f"{part.name} ({held})"
    return part.name
