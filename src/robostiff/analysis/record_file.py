"""Records on disk, in the user's cache: a robot that was recorded once is not recorded again.

A file has its length and SHA-256, and plain JSON; nothing in it is run but the operations of a
record. It is named by the SHA-256 of all that the record depends on: the robot, outputs, and the
sources of this package. Files of others are not read. ``ROBOSTIFF_CACHE`` is the folder,
or ``off``. What an answer depends on is plain data to the last digit, so that it can also be said
in what two answers differ.
"""

from __future__ import annotations

import hashlib
import json
import marshal
import os
import stat
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis.compiled_answer import AtGeneralPoses, RecordedRanks
from robostiff.compiled import (
    ArrayCode,
    ComplianceMatrix,
    DeflectionUnder,
    Derivative,
    DisplacementUnder,
    EntryOf,
    Gradient,
    Kernel,
    PrincipalStiffness,
    StiffnessMatrix,
    TensionsOf,
    TotalMass,
    WorstDeflection,
)
from robostiff.compiled.closed import ClosedCode, StepCodes
from robostiff.elastostatics import Status
from robostiff.frozen import frozen
from robostiff.model.batched import names_of
from robostiff.record import Program
from robostiff.spatial import Space
from robostiff.version import __version__
from robostiff.whole_file import whole_file

_MOST = 100  # entries of an array that are kept; of a larger one its SHA-256 alone


def plain(thing: Any, known: dict[int, Any] | None = None) -> Any:
    """A frozen object in lists, mappings and texts, as JSON has them.

    Floats are written in base 16, so that none is rounded. An object is a list of its kind and its
    fields; a mapping has the order of its keys, as that of the axes of a grid decides the shape.
    What stands in several places, as the chain of equal legs, is `known` from the first.
    """
    kind, known = type(thing), {} if known is None else known
    found: Any
    match thing:
        case float() | np.floating():  # most of all
            found = float(thing).hex()
        case None | bool() | str():
            found = thing
        case int() | np.integer():
            found = int(thing)
        case Enum():
            found = [kind.__name__, thing.name]
        case np.ndarray() if thing.size > _MOST and thing.dtype != object:
            data = np.ascontiguousarray(thing, dtype=thing.dtype.newbyteorder("<"))
            digest = hashlib.sha256(data.tobytes()).hexdigest()
            found = ["array", list(thing.shape), data.dtype.str, digest]
        case np.ndarray():
            found = ["array", list(thing.shape), plain(thing.ravel().tolist(), known)]
        case tuple() | list():
            found = [plain(entry, known) for entry in thing]
        case _ if is_dataclass(thing):
            each = ((name, plain(getattr(thing, name), known)) for name in names_of(kind))
            found = known.get(id(thing)) or [kind.__name__, dict(each)]
            known[id(thing)] = found
        case _ if hasattr(thing, "as_matrix"):  # rotations and rigid transforms of SciPy
            found = [kind.__name__, plain(thing.as_matrix())]
        case Mapping():
            own = {str(key): plain(value, known) for key, value in thing.items()}
            found = ["mapping", list(own), own]
        case frozenset():
            found = sorted(plain(entry, known) for entry in thing)
        case _:  # symbols and other exact numbers are distinguished by their text
            found = [kind.__name__, str(thing)]
    return found


def differences(one: Any, other: Any, where: str) -> Iterator[str]:
    """Where two descriptions by `plain` differ, and the values that stand there."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for name in one:
            yield from differences(one[name], other[name], f"{where}.{name}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        # the kind of an object, which no number in base 16 is
        has_kind = bool(one) and isinstance(one[0], str) and one[0].isidentifier()
        has_kind = has_kind and one[0] == other[0]
        for i, (own, another) in enumerate(zip(one, other, strict=True)):
            name = _name(own)
            place = f" {name!r}" if name is not None and name == _name(another) else f"[{i}]"
            yield from differences(own, another, where if has_kind else f"{where}{place}")
    elif one != other:
        yield f"{where}: {_value(one)}, now {_value(other)}"


def _name(thing: Any) -> str | None:
    """The name of an object, such as a leg."""
    match thing:
        case [str(), {"name": str(name)}]:
            return name
    return None


def _value(thing: Any) -> str:
    if isinstance(thing, str) and thing.lstrip("-").startswith("0x"):
        return repr(float.fromhex(thing))
    text = str(thing)
    return text if len(text) <= 40 else f"{text[:39]}…"


_MAGIC = b"robostiff record 1"
_LARGEST = 2**26  # bytes
_MOST_FILES = 500
_HEAD = len(_MAGIC) + 1 + 64 + 1


#: What a file may hold beside numbers, texts and lists, by name.
_KINDS: dict[str, Any] = {
    kind.__name__: kind
    for kind in (
        *(Program, Kernel, ArrayCode, ClosedCode, StepCodes, AtGeneralPoses, RecordedRanks),
        *(StiffnessMatrix, ComplianceMatrix, DeflectionUnder, PrincipalStiffness, WorstDeflection),
        *(DisplacementUnder, EntryOf, TensionsOf, TotalMass, Derivative, Gradient, Space, Status),
    )
}


def data_of(x: Any, known: dict[int, tuple[int, Any]]) -> Any:
    """Records as JSON has them, each once; their kernels run by NumPy, whatever runs them here.

    `known` has the place of each that was written before, and keeps it alive.
    """
    if isinstance(x, Enum):
        return {type(x).__name__: x.value}
    if not is_dataclass(x):
        return [data_of(own, known) for own in x] if isinstance(x, tuple | list) else x
    if id(x) not in known:
        same = x.by(ArrayCode) if isinstance(x, Kernel) else x
        each = ((name, getattr(same, name)) for name in names_of(type(same)))
        is_program = isinstance(x, Program)
        own = x.as_data() if is_program else {name: data_of(y, known) for name, y in each}
        known[id(x)] = len(known), x
        return {type(x).__name__: own}
    return {"known": known[id(x)][0]}


def made_of(data: Any, known: list[Any]) -> Any:
    """What `data_of` wrote; ValueError, TypeError or LookupError where it did not."""
    if not isinstance(data, dict):
        return tuple(made_of(own, known) for own in data) if isinstance(data, list) else data
    ((name, own),) = data.items()
    if name == "known":
        return known[own]
    kind = _KINDS[name]
    if issubclass(kind, Enum):
        return kind(tuple(own) if isinstance(own, list) else own)
    is_program = kind is Program
    values = {} if is_program else {key: made_of(x, known) for key, x in own.items()}
    known.append(Program.from_data(own) if is_program else kind(**values))
    return known[-1]


@frozen
class RecordFile:
    """The place of one record on disk."""

    path: Path

    @classmethod
    def of(cls, subject: Any, given: Sequence[Any]) -> RecordFile | None:
        """That of a robot or linkage, for outputs, or for what acts on it.

        None where nothing is kept: the cache is off, or something given is a class of somebody
        else, of which no source is known.
        """
        folder = _folder()
        if folder is None or not all(map(_is_ours, given)):
            return None
        about = [plain(subject), plain(list(given)), _sources()]
        name = hashlib.sha256(marshal.dumps(about, 0)).hexdigest()  # a third of the time of JSON
        return cls(folder / f"{name}.record")

    def read(self) -> tuple[Any, ...] | None:
        """What was kept; None where there is nothing, or nothing that this user wrote whole."""
        try:
            if not _is_own(self.path.parent.stat()):
                return None
            flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
            with open(os.open(self.path, os.O_RDONLY | flags), "rb") as file:
                status = os.fstat(file.fileno())
                if not (stat.S_ISREG(status.st_mode) and _is_own(status)):
                    return None
                content = file.read(_LARGEST + 1)
        except OSError:
            return None
        body = content[_HEAD:]
        if len(content) > _LARGEST or content[:_HEAD] != _head(body):
            return None
        with suppress(OSError):
            os.utime(self.path)  # the oldest files go first
        try:
            made = made_of(json.loads(body), [])
        except (
            *(ValueError, TypeError, LookupError),
            *(ArithmeticError, AttributeError, RecursionError),
        ):
            return None
        return made if isinstance(made, tuple) else None

    def write(self, parts: tuple[Any, ...]) -> None:
        """Keep it, whole or not at all; a disk that takes nothing is no error."""
        body = json.dumps(data_of(parts, {})).encode()
        if len(body) + _HEAD > _LARGEST:
            return
        with suppress(OSError):
            folder = self.path.parent
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not _is_own(folder.stat()):
                return
            with whole_file(self.path) as begun:
                begun.touch(mode=0o600)
                begun.write_bytes(_head(body) + body)
            files = sorted(folder.glob("*.record"), key=lambda own: own.stat().st_mtime)
            for old in files[:-_MOST_FILES]:
                old.unlink(missing_ok=True)


def _head(body: bytes) -> bytes:
    return b"%s\n%s\n" % (_MAGIC, hashlib.sha256(body).hexdigest().encode())


def _is_own(status: os.stat_result) -> bool:
    """Whether a file or folder is this user's, and nobody else writes to it."""
    if not hasattr(os, "geteuid"):  # Windows keeps the folders of users apart
        return True
    others = stat.S_IWGRP | stat.S_IWOTH
    return status.st_uid == os.geteuid() and not status.st_mode & others


def _folder() -> Path | None:
    wanted = os.environ.get("ROBOSTIFF_CACHE", "")
    if wanted.lower() == "off":
        return None
    if wanted:
        return Path(wanted).absolute()
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        caches = os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local"
    elif sys.platform == "darwin":
        caches = home / "Library" / "Caches"
    else:
        caches = os.environ.get("XDG_CACHE_HOME") or home / ".cache"
    return Path(caches) / "robostiff"


def _is_ours(given: Any) -> bool:
    """Whether numbers, texts, and classes of this package alone are in what is given."""
    if isinstance(given, Mapping):
        return all(map(_is_ours, given.values()))
    if isinstance(given, list | tuple):
        return all(map(_is_ours, given))
    if is_dataclass(given) and type(given).__module__.startswith("robostiff."):
        return all(_is_ours(getattr(given, name)) for name in names_of(type(given)))
    return given is None or isinstance(given, np.ndarray | np.generic | str | int | float | Enum)


@cache
def _sources() -> list[Any]:
    """Versions, and size and time of each source file of this package."""
    root, stamps = str(Path(__file__).parents[1]), []
    for folder, _, names in os.walk(root):
        for name in names:
            if name.endswith(".py"):
                path = os.path.join(folder, name)
                status = os.stat(path)
                stamps.append((path[len(root) :], status.st_size, status.st_mtime_ns))
    digest = hashlib.sha256(json.dumps(sorted(stamps)).encode()).hexdigest()
    return [__version__, np.__version__, sys.byteorder, digest]
