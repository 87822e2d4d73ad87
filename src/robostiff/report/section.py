"""A section of a report: a heading, an anchor, and what stands below, in whatever it is written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from robostiff.analytic import RobotDerivation
from robostiff.markup import Block
from robostiff.report.figures import Figure


@dataclass(frozen=True)
class Formula:
    """A derivation, typeset step by step."""

    derivation: RobotDerivation


@dataclass(frozen=True)
class Folded:
    """What is shown when asked for, below a title; on paper it is there at once."""

    title: str
    parts: tuple[Block | Formula, ...]


@dataclass(frozen=True)
class SideBySide:
    """Blocks beside each other where there is room."""

    blocks: tuple[Block, ...]


Part = Block | Figure | Folded | Formula | SideBySide


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes
    ----------
    anchor : str
        Name in links.
    title : str
    parts : tuple of Part
    """

    anchor: str
    title: str
    parts: tuple[Part, ...]

    @property
    def figures(self) -> list[Figure]:
        """Its figures."""
        return [part for part in self.parts if isinstance(part, Figure)]


def section(anchor: str, title: str, parts: Iterable[Part | None]) -> Section:
    """A section; parts that are None are left out."""
    return Section(anchor, title, tuple(part for part in parts if part is not None))
