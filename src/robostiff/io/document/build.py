"""Building data and their locations together, bounded and without recursion."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from robostiff.errors import FileError, Location
from robostiff.io.document.document import Mark, written_path
from robostiff.io.document.limits import Limits


@dataclass
class _Open:
    """A list or mapping that is being read, with the key of the next value."""

    data: Any
    mark: Mark
    path: tuple[str | int, ...]
    key: tuple[str, int, int] | None = None

    @property
    def next_path(self) -> tuple[str | int, ...]:
        """The path of what comes next."""
        if isinstance(self.data, list):
            return (*self.path, len(self.data))
        return (*self.path, self.key[0]) if self.key else self.path


@dataclass
class Builder:
    """Takes the pieces of a document in order and puts them together."""

    file: str
    limits: Limits
    data: Any = None
    mark: Mark | None = None
    _open: list[_Open] = field(default_factory=list)
    _nodes: int = 0

    @property
    def expects_key(self) -> bool:
        """Whether the next scalar is the key of a mapping."""
        return bool(self._open) and isinstance(self._open[-1].data, dict) and not self._open[-1].key

    def place(self, line: int, column: int) -> Location:
        """A place, with the path of what is being read there."""
        return Location(self.file, line, column, written_path(self._path))

    def key(self, key: str, line: int, column: int) -> None:
        """The key of the next value."""
        top = self._open[-1]
        if key in top.data:
            first = top.mark.child(key)
            top.key = (key, line, column)
            raise FileError(
                self.place(line, column),
                "duplicate key",
                got=key,
                expected=f"each key once; line {first.key_line if first else '?'} has it already",
            )
        if len(top.data) >= self.limits.keys:
            raise self.limits.too_many_keys(self.place(line, column))
        top.key = (key, line, column)

    def scalar(self, value: Any, line: int, column: int) -> None:
        """A value that holds no others."""
        self._add(value, Mark(line, column))

    def start(self, data: list[Any] | dict[str, Any], line: int, column: int) -> None:
        """The start of a list or mapping."""
        if len(self._open) >= self.limits.depth:
            raise self.limits.too_deep(Location(self.file, line, column))
        mark = Mark(line, column, children=[] if isinstance(data, list) else {})
        path = self._path
        self._add(data, mark)
        self._open.append(_Open(data, mark, path))

    def end(self) -> None:
        """The end of the innermost list or mapping."""
        self._open.pop()

    @property
    def _path(self) -> tuple[str | int, ...]:
        return self._open[-1].next_path if self._open else ()

    def _add(self, value: Any, mark: Mark) -> None:
        self._nodes += 1
        if self._nodes > self.limits.nodes:
            raise self.limits.too_many(self.place(mark.line, mark.column))
        if not self._open:
            self.data, self.mark = value, mark
            return
        top = self._open[-1]
        match top.data, top.mark.children:
            case list() as items, list() as marks:
                items.append(value)
                marks.append(mark)
            case dict() as entries, dict() as marks if top.key:
                name, mark.key_line, mark.key_column = top.key
                entries[name] = value
                marks[name] = mark
                top.key = None
