"""A section of a report: a heading, an anchor, and what stands below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robostiff.report.figures import Figure


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes
    ----------
    anchor : str
        Name in links.
    title : str
    parts : tuple of str or Figure
        HTML, and figures between.
    """

    anchor: str
    title: str
    parts: tuple[str | Figure, ...]

    @property
    def figures(self) -> list[Figure]:
        """Its figures."""
        return [part for part in self.parts if isinstance(part, Figure)]


def section(anchor: str, title: str, *parts: Any) -> Section:
    """A section; parts that are empty are left out."""
    return Section(anchor, title, tuple(part for part in parts if part))
