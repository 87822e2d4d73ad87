"""Records on disk, in the user's cache: a robot that was recorded once is not recorded again.

A file has its length and SHA-256, and plain JSON; nothing in it is run but the operations of a
record. It is named by the SHA-256 of all that the record depends on: the robot, outputs, and the
sources of this package. Files of others are not read. ``ROBOSTIFF_CACHE`` is the folder,
or ``off``.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.analysis.identity import plain
from robostiff.compiled import Output
from robostiff.version import __version__
from robostiff.whole_file import whole_file

_MAGIC = b"robostiff record 1"
_LARGEST = 2**26  # bytes
_MOST_FILES = 500
_HEAD = len(_MAGIC) + 1 + 64 + 1


def kept_on_disk(
    about: tuple[Any, Sequence[Output]],
    read: Callable[[Mapping[str, Any]], Any],
    make: Callable[[], Any],
) -> Any:
    """What is on disk about a robot or linkage, else what is made, which is put there.

    It is made of data, and into them, by methods ``from_data`` and ``as_data``.
    """
    file = RecordFile.of(*about)
    data = None if file is None else file.read()
    if data is not None:
        with suppress(ValueError, TypeError, LookupError, ArithmeticError, AttributeError):
            return read(data)
    made = make()
    if file is not None:
        file.write(made.as_data())
    return made


@dataclass(frozen=True)
class RecordFile:
    """The place of one record on disk."""

    path: Path

    @classmethod
    def of(cls, subject: Any, outputs: Sequence[Output]) -> RecordFile | None:
        """That of a robot or linkage.

        None where nothing is kept: the cache is off, or an output is a class of somebody else, of
        which no source is known.
        """
        folder = _folder()
        if folder is None or not all(map(_is_ours, outputs)):
            return None
        about = [plain(subject), plain(list(outputs)), _sources()]
        name = hashlib.sha256(json.dumps(about).encode()).hexdigest()
        return cls(folder / f"{name}.record")

    def read(self) -> Mapping[str, Any] | None:
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
        try:
            data = json.loads(body)
        except (ValueError, RecursionError):
            return None
        with suppress(OSError):
            os.utime(self.path)  # the oldest files go first
        return data if isinstance(data, dict) else None

    def write(self, data: Mapping[str, Any]) -> None:
        """Keep it, whole or not at all; a disk that takes nothing is no error."""
        body = json.dumps(data).encode()
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


def _is_ours(output: Any) -> bool:
    own = type(output).__module__.startswith("robostiff.")
    inner = (
        [getattr(output, field.name) for field in fields(output)] if is_dataclass(output) else []
    )
    return own and all(_is_ours(x) for x in inner if is_dataclass(x))


@cache
def _sources() -> list[Any]:
    """Versions, and size and time of each source file of this package."""
    root = Path(__file__).parents[1]
    files = [(str(own.relative_to(root)), own.stat()) for own in sorted(root.rglob("*.py"))]
    stamps = [[name, status.st_size, status.st_mtime_ns] for name, status in files]
    digest = hashlib.sha256(json.dumps(stamps).encode()).hexdigest()
    return [__version__, np.__version__, sys.byteorder, digest]
