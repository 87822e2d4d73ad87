"""Fingerprints of maps: descriptions that do not depend on machine and time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import singledispatch
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation


def fingerprint(thing: Any) -> str:
    """SHA-256 of everything that a frozen object consists of, to the last digit.

    Examples
    --------
    >>> fingerprint({"a": np.zeros(2)}) == fingerprint({"a": np.zeros(2)})
    True
    >>> fingerprint([1.0]) == fingerprint([1.0 + 1e-15])
    False
    """
    text = json.dumps(_plain(thing), separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


@singledispatch
def _plain(thing: Any) -> Any:
    """The same in lists, mappings and texts; the kind of every object included."""
    if is_dataclass(thing):
        own = {field.name: _plain(getattr(thing, field.name)) for field in fields(thing)}
        return [type(thing).__name__, own]
    # Symbols and other exact numbers are distinguished by their text.
    return [type(thing).__name__, str(thing)]


@_plain.register(type(None))
@_plain.register(bool)
@_plain.register(str)
def _(thing: bool | str | None) -> Any:
    return thing


@_plain.register(int)
@_plain.register(np.integer)
def _(thing: int | np.integer) -> int:
    return int(thing)


@_plain.register(float)
@_plain.register(np.floating)
def _(thing: float | np.floating) -> str:
    return float(thing).hex()


@_plain.register
def _(thing: Enum) -> list[str]:
    return [type(thing).__name__, thing.name]


@_plain.register
def _(thing: np.ndarray) -> list[Any]:
    if thing.dtype == object:
        return [list(thing.shape), [_plain(entry) for entry in thing.flat]]
    data = np.ascontiguousarray(thing, dtype=thing.dtype.newbyteorder("<"))
    return [list(data.shape), data.dtype.str, hashlib.sha256(data.tobytes()).hexdigest()]


@_plain.register(RigidTransform)
@_plain.register(Rotation)
def _(thing: RigidTransform | Rotation) -> list[Any]:
    return [type(thing).__name__, _plain(thing.as_matrix())]


@_plain.register
def _(thing: Mapping) -> list[Any]:
    # In the order given: that of the axes of a grid decides the shape of its map.
    return [[str(key), _plain(value)] for key, value in thing.items()]


@_plain.register
def _(thing: frozenset) -> list[Any]:
    return sorted(_plain(entry) for entry in thing)


@_plain.register(tuple)
@_plain.register(list)
def _(thing: tuple[Any, ...] | list[Any]) -> list[Any]:
    return [_plain(entry) for entry in thing]
