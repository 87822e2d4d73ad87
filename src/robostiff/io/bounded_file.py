"""Files that are read within bounds, and which they were."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from robostiff.errors import FileError, InputError, Location, Words

_PART = 2**24  # bytes


def bounded_bytes(source: str | os.PathLike[str], most: int, what: str) -> bytes:
    """The content of a file of so many bytes at most; no more than that is read.

    Raises FileError when it is a folder and not `what`, cannot be read, or is too large.
    """
    if not isinstance(source, str | os.PathLike):  # a number is a stream that is open already
        raise InputError(what, got=source, expected="the path of a file")
    place = Location(str(source))
    try:
        status = os.stat(source)
        if stat.S_ISDIR(status.st_mode):
            raise FileError(place, "a folder", expected=what)
        if status.st_size > most:
            raise too_large(place, status.st_size, most)
        with open(source, "rb") as stream:
            content = bytearray()  # grown as there is something to read
            while len(content) <= most and (part := stream.read(min(most + 1, _PART))):
                content += part
    except FileError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(
            place, "cannot read the file", got=Words(reason), expected="a readable file"
        ) from None
    if len(content) > most:
        raise too_large(place, len(content), most)
    if (files := _READ.get()) is not None:
        files[os.path.realpath(source)] = hashlib.sha256(content).hexdigest()
    return bytes(content)


_READ: ContextVar[dict[str, str] | None] = ContextVar("files that are read", default=None)


@contextmanager
def files_that_are_read() -> Iterator[dict[str, str]]:
    """Whole paths of files that are read inside, and the SHA-256 of each."""
    files: dict[str, str] = {}
    token = _READ.set(files)
    try:
        yield files
    finally:
        _READ.reset(token)


def read_elsewhere(files: dict[str, str]) -> None:
    """Files that another process has read for this one, and the SHA-256 of each."""
    known = _READ.get()
    if known is not None:
        known |= files


def too_large(place: Location, size: int, most: int) -> FileError:
    """The error for a file of more bytes than it may have, of which one more may have been read."""
    came = Words(f"{size} bytes" if size > most + 1 else f"more than {most} bytes")
    return FileError(place, "file too large", got=came, expected=f"at most {most} bytes")
