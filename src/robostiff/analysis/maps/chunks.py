"""Chunks of a map on disk: each has its own checksum (crc32c), looked at when it is read."""

from __future__ import annotations

from typing import Any

from zarr.storage import LocalStore

from robostiff.analysis.maps.stored import StoredMap, damaged, is_sound


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
        if not is_chunk or name not in self.stored.described:
            return found
        if found is None:
            if self.stored.identity["complete"]:
                raise damaged(self.stored.path, f"no {key}")
            return None  # not computed yet
        if not is_sound(found.to_bytes()):
            raise damaged(self.stored.path, f"{key} that does not agree with its checksum")
        return found
