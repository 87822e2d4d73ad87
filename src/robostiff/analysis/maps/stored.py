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

from robostiff.errors import InputError

IDENTITY = "robostiff_map"
MOST_POSES = 10**12
_LARGEST_DESCRIPTION = 2**24
_LARGEST_CHUNK = 2**24  # values
_MOST_DIMENSIONS = 16
_TYPES = ("int8", "uint16", "int64", "float32", "float64", "string", "variable_length_utf8")
_CHECKSUM = 4  # bytes


@dataclass(frozen=True)
class StoredMap:
    """A store whose description is sound."""

    path: Path
    root: dict[str, Any]  # what ``zarr.json`` has

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
        for name, own in described.items():
            _check_array(path, name, own)
    except OSError as error:
        raise damaged(path, f"a zarr.json that cannot be read ({error.strerror})") from None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise damaged(path, "a zarr.json that describes no map") from None
    return StoredMap(path, root)


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


def _check_array(path: Path, name: str, described: Mapping[str, Any]) -> None:
    """Raise where an array is larger than those of maps, or of another kind."""
    chunk = described["chunk_grid"]["configuration"]["chunk_shape"]
    shape, codecs = described["shape"], [codec["name"] for codec in described["codecs"]]
    sizes = [*shape, *chunk]
    if not all(type(n) is int and n >= 0 for n in sizes) or len(sizes) > 2 * _MOST_DIMENSIONS:
        raise ValueError(sizes)
    if not name.strip(".") or "/" in name or "\\" in name or described["data_type"] not in _TYPES:
        raise damaged(path, f"an array {name!r} that robostiff does not write")
    if math.prod(chunk) > _LARGEST_CHUNK or math.prod(shape) > 36 * MOST_POSES:
        raise damaged(path, f"{name!r} larger than robostiff writes")
    if codecs[-1:] != ["crc32c"]:
        raise damaged(path, f"chunks of {name!r} that robostiff does not write")


def is_sound(chunk: bytes | None) -> bool:
    """Whether a chunk is there and agrees with its checksum, which is its end."""
    import google_crc32c

    if chunk is None or len(chunk) < _CHECKSUM:
        return False
    return google_crc32c.value(chunk[:-_CHECKSUM]) == int.from_bytes(chunk[-_CHECKSUM:], "little")
