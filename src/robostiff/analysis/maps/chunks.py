"""Chunks of a map on disk: each has its own checksum (crc32c), looked at when it is read."""

from __future__ import annotations

import math
from typing import Any

import google_crc32c
from zarr.storage import LocalStore

from robostiff.analysis.maps.stored import StoredArray, StoredMap, damaged

_CHECKSUM = 4
_BLOSC_HEADER = 16


class CheckedChunks(LocalStore):
    """The files of a map, to be read through Zarr."""

    def __init__(self, stored: StoredMap, *, read_only: bool = True) -> None:
        super().__init__(stored.path, read_only=read_only)
        self.stored = stored

    def with_read_only(self, read_only: bool = False) -> CheckedChunks:
        """The same."""
        return CheckedChunks(self.stored, read_only=read_only)

    async def get(self, key: str, *args: Any, **kwargs: Any) -> Any:
        """A file, checked where it is a chunk."""
        try:
            found = await super().get(key, *args, **kwargs)
        except OSError as error:
            raise damaged(self.stored.path, f"{key} that cannot be read ({error})") from None
        return self._checked(key, found)

    def get_sync(self, key: str, **kwargs: Any) -> Any:
        """As `get`."""
        try:
            found = super().get_sync(key, **kwargs)
        except OSError as error:
            raise damaged(self.stored.path, f"{key} that cannot be read ({error})") from None
        return self._checked(key, found)

    def _checked(self, key: str, found: Any) -> Any:
        name, is_chunk, _ = key.partition("/c")
        array = self.stored.arrays.get(name)
        if not is_chunk or array is None:
            return found
        if found is None:
            if self.stored.identity["complete"]:
                raise damaged(self.stored.path, f"no {key}")
            return None  # not computed yet
        if not is_sound(found.to_bytes(), array):
            raise damaged(self.stored.path, f"{key} that does not agree with its checksum")
        return found


def is_sound(chunk: bytes, array: StoredArray) -> bool:
    """Whether a chunk has its checksum, and the size that its array says."""
    content = memoryview(chunk)[:-_CHECKSUM]
    if len(content) + _CHECKSUM != len(chunk):
        return False
    if google_crc32c.value(bytes(content)) != int.from_bytes(chunk[-_CHECKSUM:], "little"):
        return False
    if array.is_packed:
        if len(content) < _BLOSC_HEADER:
            return False
        unpacked = int.from_bytes(content[4:8], "little")
        packed = int.from_bytes(content[12:16], "little")
        return unpacked == array.chunk_bytes and packed == len(content)
    if array.bytes_a_value:
        return len(content) == array.chunk_bytes
    return int.from_bytes(content[:4], "little") == math.prod(array.chunk)
