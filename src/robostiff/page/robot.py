"""A robot in short."""

from __future__ import annotations

from robostiff.markup import Block, Facts, Page, Table
from robostiff.model import Robot
from robostiff.model.in_words import elements_in_words


def robot_page(robot: Robot) -> Page:
    """Title, symbols, elements of the legs, free coordinates and source."""
    legs = [[leg.name, ", ".join(elements_in_words(leg.chain))] for leg in robot.legs]
    facts = {
        "symbols": ", ".join(map(str, robot.symbols)),
        "free coordinates": " ".join(coordinate.value for coordinate in robot.coordinates),
        "source": robot.source,
    }
    blocks: list[Block] = [
        Table(["leg", "from base to platform"], legs),
        Facts(tuple((name, words) for name, words in facts.items() if words)),
    ]
    return Page(robot.name, f": {robot.title}" if robot.title else "", blocks=blocks)
