"""The description of a map on disk: one file, checked before memory is allocated.

``zarr.json`` has the attributes of the map and, as consolidated metadata of Zarr, the description
of every array, all under one checksum. ``chunks`` checks what is in the arrays.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import InputError

IDENTITY = "robostiff_map"
MOST_POSES = 10**12
_LARGEST_DESCRIPTION = 2**24
_LARGEST_CHUNK = 2**27
_MOST_DIMENSIONS = 16
_WORDS = "variable_length_utf8", "string"
_TYPES = ("int8", "uint16", "int64", "float32", "float64", *_WORDS)
_CODECS = ("transpose", "bytes", "vlen-utf8", "blosc", "crc32c")


@dataclass(frozen=True)
class StoredArray:
    """An array of a store."""

    chunk: tuple[int, ...]  # shape of a chunk
    bytes_a_value: int  # 0 of words, whose lengths differ
    is_packed: bool  # whether its chunks are compressed

    @property
    def chunk_bytes(self) -> int:
        """Of a chunk that is not compressed."""
        return math.prod(self.chunk) * self.bytes_a_value


@dataclass(frozen=True)
class StoredMap:
    """A store whose description is sound."""

    path: Path
    root: dict[str, Any]  # what ``zarr.json`` has
    arrays: Mapping[str, StoredArray]

    @property
    def identity(self) -> dict[str, Any]:
        """``parts`` of the request, names of ``variables``, and whether it is ``complete``."""
        return self.root["attributes"][IDENTITY]

    @property
    def described(self) -> dict[str, Any]:
        """The description of each array, as in its own ``zarr.json``."""
        return self.root["consolidated_metadata"]["metadata"]


def damaged(path: Path, what: str) -> InputError:
    """The error for a damaged store or file."""
    return InputError(
        f"map {str(path)!r} is damaged: it has {what}",
        hint="make the map again at another path, or take a copy of it",
    )


def read_store(path: Path) -> StoredMap:
    """Read and check the description of a map.

    Raises
    ------
    InputError
        When it is none, is damaged, or describes more than robostiff writes.
    """
    file = path / "zarr.json"
    if not file.is_file():
        raise _no_map(path)
    try:
        with file.open("rb") as opened:
            content = opened.read(_LARGEST_DESCRIPTION + 1)
        if len(content) > _LARGEST_DESCRIPTION:
            raise damaged(path, f"a zarr.json of more than {_LARGEST_DESCRIPTION} bytes")
        root = json.loads(content)
        attributes = root["attributes"]
        if IDENTITY not in attributes:
            raise _no_map(path)
        if attributes[IDENTITY]["checksum"] != _checksum(root):
            raise damaged(path, "a zarr.json that does not agree with its checksum")
        described = root["consolidated_metadata"]["metadata"]
        arrays = {name: _array(path, name, own) for name, own in described.items()}
    except OSError as error:
        raise damaged(path, f"a zarr.json that cannot be read ({error.strerror})") from None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise damaged(path, "a zarr.json that describes no map") from None
    return StoredMap(path, root, arrays)


def _no_map(path: Path) -> InputError:
    return InputError("store of a map", got=str(path), expected="a map that was begun by robostiff")


def write_root(path: Path, root: dict[str, Any]) -> None:
    """Write the description of a map with its checksum, whole or not at all."""
    root["attributes"][IDENTITY]["checksum"] = _checksum(root)
    begun = path / "zarr.json.begun"
    with begun.open("w", encoding="utf-8") as file:
        json.dump(root, file)
        file.flush()
        os.fsync(file.fileno())
    begun.replace(path / "zarr.json")


def _checksum(root: Mapping[str, Any]) -> str:
    """Of all but itself."""
    attributes = root["attributes"]
    identity = {name: own for name, own in attributes[IDENTITY].items() if name != "checksum"}
    every = {**root, "attributes": {**attributes, IDENTITY: identity}}
    return hashlib.sha256(json.dumps(every).encode()).hexdigest()


def _array(path: Path, name: str, described: Mapping[str, Any]) -> StoredArray:
    """Shape, chunks and codecs, each within bounds."""
    kind, shape = described["data_type"], _sizes(described["shape"])
    chunk = _sizes(described["chunk_grid"]["configuration"]["chunk_shape"])
    if not name.strip(".") or "/" in name or "\\" in name or kind not in _TYPES:
        raise damaged(path, f"an array {name!r} that robostiff does not write")
    size = 0 if kind in _WORDS else np.dtype(kind).itemsize
    if math.prod(chunk) * max(size, 8) > _LARGEST_CHUNK or math.prod(shape) > 36 * MOST_POSES:
        raise damaged(path, f"{name!r} larger than robostiff writes")
    names = [codec["name"] for codec in described["codecs"]]
    ordered = [codec for codec in _CODECS if codec in names]
    if len(shape) != len(chunk) or 0 in chunk or names != ordered or names[-1:] != ["crc32c"]:
        raise damaged(path, f"chunks of {name!r} that robostiff does not write")
    return StoredArray(chunk, size, "blosc" in names)


def _sizes(given: Any) -> tuple[int, ...]:
    if len(given) > _MOST_DIMENSIONS or not all(type(n) is int and n >= 0 for n in given):
        raise ValueError(given)
    return tuple(given)
