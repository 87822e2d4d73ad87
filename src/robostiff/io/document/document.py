"""Plain data with locations, and their building: bounded, and without recursion."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import reduce
from operator import getitem
from typing import Any, ClassVar, Self

from robostiff.errors import UNSAID, FileError, InputError, Location, Words
from robostiff.frozen import frozen
from robostiff.io.suggest import did_you_mean, listing


@frozen
class Limits:
    """Bounds on a document; YAML takes much longer to read than JSON, and has narrower ones."""

    size: int = 4_000_000  # of the file [bytes]
    depth: int = 64  # of lists and mappings inside each other
    nodes: int = 200_000  # values in all
    keys: int = 10_000  # of one mapping
    yaml_size: int = 1_000_000  # of a YAML text [bytes]
    yaml_marks: int = 20_000  # line ends and commas in it

    def exceeded(self, bound: str, place: Location) -> FileError:
        """The error for more than a document may have of ``depth``, ``nodes`` or ``keys``."""
        most = getattr(self, bound)
        subject, levels, where = {
            "depth": ("nesting too deep", " levels", ""),
            "nodes": ("too many values", "", ""),
            "keys": ("too many keys", "", " in a mapping"),
        }[bound]
        got, expected = Words(f"more than {most}{levels}"), f"at most {most}{where}"
        return FileError(place, subject, got=got, expected=expected)


_PLAIN_KEY = re.compile(r"[^\W\d][\w-]*")


#: Keys and 0-based list positions, from the top.
Path = tuple[str | int, ...]
#: Line and column of each value, and behind them those of its key where it has one.
Marks = dict[Path, tuple[int, ...]]


@frozen
class Document:
    r"""Data of a file, and their locations.

    Attributes
    ----------
    data : dict, list, str, int, float, bool or None
        Plain data; mappings have text keys.
    file : str
        The name for messages.
    """

    data: Any
    file: str
    _find_marks: Callable[[], Marks] = field(repr=False, compare=False)

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
        marks, nearest = self._find_marks(), tuple(path)
        while nearest not in marks:
            nearest = nearest[:-1]
        line, column, *_ = marks[nearest]
        return Location(self.file, line, column, written_path(path))

    def key_location(self, path: Sequence[str | int]) -> Location:
        """The location of the key at the end of a path, for errors about the key itself.

        The place of the value if it has no key, as in a list; of the nearest ancestor if there is
        no such value.
        """
        mark = self._find_marks().get(tuple(path))
        if mark is None:
            return self.location(path)
        *_, line, column = mark
        return Location(self.file, line, column, written_path(path))


def written_path(path: Sequence[str | int]) -> str:
    """The path as messages show it."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        elif _PLAIN_KEY.fullmatch(step):
            text += f".{step}" if text else step
        else:
            text += '["' + (step if len(step) <= 40 else step[:39] + "…") + '"]'
    return text


@dataclass
class _Open:
    """A list or mapping that is being read, with the key of the next value."""

    data: Any
    path: Path
    key: tuple[str, int, int] | None = None


@dataclass
class Builder:
    """Takes the pieces of a document in order and puts them together."""

    file: str
    limits: Limits
    data: Any = None
    marks: Marks = field(default_factory=dict)
    _open: list[_Open] = field(default_factory=list)

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
            first = self.marks[*top.path, key][2]
            top.key = (key, line, column)
            expected = f"each key once; line {first} has it already"
            raise FileError(self.place(line, column), "duplicate key", got=key, expected=expected)
        if len(top.data) >= self.limits.keys:
            raise self.limits.exceeded("keys", self.place(line, column))
        top.key = (key, line, column)

    def value(self, value: Any, line: int, column: int) -> None:
        """The next value."""
        if len(self.marks) >= self.limits.nodes:
            raise self.limits.exceeded("nodes", self.place(line, column))
        path, top = self._path, self._open[-1] if self._open else None
        self.marks[path] = (line, column)
        if top is None:
            self.data = value
        elif isinstance(top.data, list):
            top.data.append(value)
        elif top.key:
            top.data[top.key[0]] = value
            self.marks[path] += top.key[1:]
            top.key = None

    def start(self, data: list[Any] | dict[str, Any], line: int, column: int) -> None:
        """The start of a list or mapping."""
        if len(self._open) >= self.limits.depth:
            raise self.limits.exceeded("depth", Location(self.file, line, column))
        path = self._path
        self.value(data, line, column)
        self._open.append(_Open(data, path))

    def end(self) -> None:
        """The end of the innermost list or mapping."""
        self._open.pop()

    @property
    def _path(self) -> Path:
        """The path of what comes next."""
        if not self._open:
            return ()
        top = self._open[-1]
        if isinstance(top.data, list):
            return (*top.path, len(top.data))
        return (*top.path, top.key[0]) if top.key else top.path


@frozen
class DocumentPlace:
    """A path in a document, at which errors are located."""

    document: Document
    path: Path = ()
    shows_lists: ClassVar[bool] = True  # as the file has them, where they are not what they must be

    def at(self, *steps: str | int) -> Self:
        """A place further down."""
        place = object.__new__(type(self))
        vars(place).update(vars(self), path=(*self.path, *steps))
        return place

    def __truediv__(self, step: str | int) -> Self:
        """The place of an entry."""
        return self.at(step)

    @property
    def value(self) -> Any:
        """What the document says here."""
        return reduce(getitem, self.path, self.document.data)

    def error(
        self,
        subject: str,
        *,
        got: Any = UNSAID,
        expected: str | None = None,
        hint: str | None = None,
        key: bool = False,
    ) -> FileError:
        """An error about the value here, or about its key."""
        locate = self.document.key_location if key else self.document.location
        got = got.tolist() if _is_array(got) else got
        return FileError(locate(self.path), subject, got=got, expected=expected, hint=hint)

    def unknown(
        self,
        subject: str,
        name: str,
        known: Iterable[str],
        *,
        what: str = "one of",
        most: int = 60,
        hint: str | None = None,
        key: bool = False,
    ) -> FileError:
        """An error about a name that is none of those known; the hint where none is like it."""
        names = list(known)
        hint = did_you_mean(name, names) or hint
        expected = f"{what} {listing(names, most)}".rstrip()
        return self.error(subject, got=name, expected=expected, hint=hint, key=key)

    @contextmanager
    def complaints(self, hint: str | None = None) -> Iterator[None]:
        """Give errors from within this location, unless they have one.

        Their hint is for Python; `hint` replaces it for files. Overflow is found by the checks.
        """
        import numpy as np

        try:
            with np.errstate(all="ignore"):
                yield
        except FileError:
            raise
        except InputError as error:
            got, hint = error.got, hint or error.hint
            if self.shows_lists and (isinstance(got, list) or _is_array(got)):
                got = self.value  # not as it was when it had become an array
            raise self.error(error.subject, got=got, expected=error.expected, hint=hint) from None


def _is_array(value: Any) -> bool:
    """Whether a value is an array of NumPy, which reading a document does not import."""
    return type(value).__name__ == "ndarray"
