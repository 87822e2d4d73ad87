"""Plain data with locations."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from robostiff.errors import Location

_PLAIN_KEY = re.compile(r"[^\W\d][\w-]*")


@dataclass(slots=True)
class Mark:
    """The place of one value, of its key if it has one, and of what it contains."""

    line: int
    column: int
    key_line: int | None = None
    key_column: int | None = None
    children: dict[str, Mark] | list[Mark] | None = None

    def child(self, step: str | int) -> Mark | None:
        """The place of an entry, or None if there is no such entry."""
        match self.children, step:
            case dict() as entries, str():
                return entries.get(step)
            case list() as items, int() if 0 <= step < len(items):
                return items[step]
        return None


@dataclass(frozen=True)
class Document:
    r"""Data of a file, and their locations.

    Attributes
    ----------
    data : dict, list, str, int, float, bool or None
        Plain data; mappings have text keys.
    file : str
        The name for messages.

    Examples
    --------
    >>> from robostiff.io.document import parse_document
    >>> document = parse_document("legs:\n  - axis: z\n", file="robot.yaml")
    >>> print(document.location(["legs", 0, "axis"]))
    robot.yaml:2:11: legs[0].axis
    """

    data: Any
    file: str
    _find_marks: Callable[[], Mark] = field(repr=False, compare=False)

    def location(self, path: Sequence[str | int] = ()) -> Location:
        """The place of the value at a path.

        Parameters
        ----------
        path : sequence of str and int
            Keys and 0-based list positions, from the top.

        Returns
        -------
        Location
            Of the value; of its nearest ancestor if there is no such value. The path in it is the
            one asked for.
        """
        mark, _ = self._nearest(path)
        return Location(self.file, mark.line, mark.column, written_path(path))

    def key_location(self, path: Sequence[str | int]) -> Location:
        """The location of the key at the end of a path, for errors about the key itself.

        The place of the value if it has no key, as in a list; of the nearest ancestor if there is
        no such value.
        """
        mark, found = self._nearest(path)
        if not found or mark.key_line is None:
            return self.location(path)
        return Location(self.file, mark.key_line, mark.key_column, written_path(path))

    def _nearest(self, path: Sequence[str | int]) -> tuple[Mark, bool]:
        mark = self._find_marks()
        for step in path:
            child = mark.child(step)
            if child is None:
                return mark, False
            mark = child
        return mark, True


def written_path(path: Sequence[str | int]) -> str:
    """The path as messages show it.

    Examples
    --------
    >>> written_path(["legs", 0, "chain", 2, "axis"])
    'legs[0].chain[2].axis'
    >>> written_path(["notes", "two words"])
    'notes["two words"]'
    """
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        elif _PLAIN_KEY.fullmatch(step):
            text += f".{step}" if text else step
        else:
            text += '["' + (step if len(step) <= 40 else step[:39] + "…") + '"]'
    return text
