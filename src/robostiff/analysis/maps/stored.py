"""Checks of a map on disk: its description is checked before memory is allocated.

Every array, and the attributes of the whole, have a checksum in the attributes, so that damage is
seen when a store is opened; ``chunks`` checks what is in the arrays.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import InputError

IDENTITY = "robostiff_map"
JOURNALS = "progress"
MOST_POSES = 10**12
_LARGEST_DESCRIPTION = 2**22
_LARGEST_CHUNK = 2**27
_MOST_DIMENSIONS = 16
_WORDS = "variable_length_utf8", "string"
_TYPES = ("int8", "uint16", "int64", "float32", "float64", *_WORDS)
_CODECS = ("transpose", "bytes", "vlen-utf8", "blosc", "crc32c")
_CHANGING = "actual_range"  # written when a map is complete, array by array


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
    # Attributes of the map: ``parts``, ``variables``, ``complete``, ``summary``
    identity: Mapping[str, Any]
    arrays: Mapping[str, StoredArray]


def damaged(path: Path, what: str) -> InputError:
    """The error for a damaged store or file."""
    return InputError(
        f"map {str(path)!r} is damaged: it has {what}",
        hint="make the map again at another path, or take a copy of it",
    )


def read_store(path: Path) -> StoredMap:
    """Read and check the description of a map: nothing is allocated by it."""
    if not (path / "zarr.json").is_file():
        raise InputError(
            "store of a map", got=str(path), expected="a map that was begun by robostiff"
        )
    root = _description(path, path / "zarr.json")
    attributes = root.get("attributes")
    if root.get("node_type") != "group" or not isinstance(attributes, dict):
        raise damaged(path, "a zarr.json that describes no group with attributes")
    identity = attributes.get(IDENTITY)
    if identity is None:
        raise InputError(
            "store of a map", got=str(path), expected="a map that was begun by robostiff"
        )
    if not isinstance(identity, dict) or "checksum" not in identity:
        raise damaged(path, "no checksum, as of a version of robostiff that had none")
    try:
        is_sealed = sealed(attributes)[IDENTITY] == identity
    except RecursionError:
        is_sealed = False
    if not (is_sealed and _says_what_it_must(identity)):
        raise damaged(path, "attributes that do not agree with their checksum")
    arrays = {}
    for name, checksum in identity["arrays"].items():
        described = _description(path, path / name / "zarr.json")
        if array_checksum(described) != checksum:
            raise damaged(path, f"a description of {name!r} that does not agree with its checksum")
        ends = described.get("attributes", {}).get(_CHANGING)
        if identity["complete"] and ends != identity["summary"]["ranges"].get(name):
            raise damaged(path, f"a range of {name!r} that does not agree with its summary")
        arrays[name] = _array(path, name, described)
    for entry in path.iterdir():
        if entry.name not in {*arrays, JOURNALS} and (entry / "zarr.json").exists():
            raise damaged(path, f"{entry.name!r}, which robostiff did not write")
    return StoredMap(path, identity, arrays)


def sealed(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of a map with their checksum; others may be added later."""
    identity = dict(attributes[IDENTITY])
    identity.pop("checksum", None)
    names = identity.get("attributes")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return {IDENTITY: {**identity, "checksum": "none"}}
    own = {name: attributes.get(name) for name in names}
    return {**own, IDENTITY: {**identity, "checksum": _checksum([own, identity])}}


def array_checksum(described: Mapping[str, Any]) -> str:
    """Checksum of the description of an array, but of what is written when a map is complete."""
    attributes = described.get("attributes", {})
    own = attributes if isinstance(attributes, dict) else {"attributes": attributes}
    own = {name: value for name, value in own.items() if name != _CHANGING}
    return _checksum({**described, "attributes": own})


def _checksum(data: Any) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _description(path: Path, file: Path) -> dict[str, Any]:
    """A ``zarr.json``."""
    where = file.relative_to(path).as_posix()
    try:
        if not file.is_file():
            raise damaged(path, f"no {where}")
        with file.open("rb") as opened:
            content = opened.read(_LARGEST_DESCRIPTION + 1)
        if len(content) > _LARGEST_DESCRIPTION:
            raise damaged(path, f"{where} of more than {_LARGEST_DESCRIPTION} bytes")
        found = json.loads(content)
    except OSError as error:
        raise damaged(path, f"{where} that cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise damaged(path, f"{where} that is not JSON") from None
    if not isinstance(found, dict):
        raise damaged(path, f"{where} that describes nothing")
    return found


def _says_what_it_must(identity: Mapping[str, Any]) -> bool:
    arrays, variables = identity.get("arrays"), identity.get("variables")
    return (
        isinstance(identity.get("parts"), dict)
        and isinstance(identity.get("complete"), bool)
        and isinstance(arrays, dict)
        and all(name.strip(".") and "/" not in name and "\\" not in name for name in arrays)
        and isinstance(variables, list)
        and all(name in arrays for name in variables)
        and (not identity["complete"] or isinstance(identity["summary"]["ranges"], dict))
    )


def _array(path: Path, name: str, described: Mapping[str, Any]) -> StoredArray:
    """Shape, chunks and codecs, each within bounds."""
    kind, grid, codecs = (described.get(key) for key in ("data_type", "chunk_grid", "codecs"))
    shape = _sizes(described.get("shape"))
    chunk = _sizes(grid["configuration"]["chunk_shape"]) if isinstance(grid, dict) else None
    if shape is None or chunk is None or len(shape) != len(chunk) or 0 in chunk:
        raise damaged(path, f"a shape or chunks of {name!r} that are none")
    if not isinstance(kind, str) or kind not in _TYPES:
        raise damaged(path, f"values of {name!r} of a type that robostiff does not write")
    size = 0 if kind in _WORDS else np.dtype(kind).itemsize
    if math.prod(chunk) * max(size, 8) > _LARGEST_CHUNK or math.prod(shape) > 36 * MOST_POSES:
        raise damaged(path, f"{name!r} larger than robostiff writes")
    names = [codec.get("name") for codec in codecs or [] if isinstance(codec, dict)]
    if names != [codec for codec in _CODECS if codec in names] or names[-1:] != ["crc32c"]:
        raise damaged(path, f"codecs of {name!r} that robostiff does not write")
    return StoredArray(chunk, size, "blosc" in names)


def _sizes(given: Any) -> tuple[int, ...] | None:
    if not isinstance(given, list) or len(given) > _MOST_DIMENSIONS:
        return None
    return tuple(given) if all(type(n) is int and n >= 0 for n in given) else None
