"""What an answer depends on, as plain data to the last digit, and in what two of them differ."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

_MOST = 100  # entries of an array that are kept; of a larger one its SHA-256 alone


def plain(thing: Any, known: dict[int, Any] | None = None) -> Any:
    """A frozen object in lists, mappings and texts, as JSON has them.

    Floats are written in base 16, so that none is rounded. An object is a list of its kind and its
    fields; a mapping has the order of its keys, as that of the axes of a grid decides the shape.
    What stands in several places, as the chain of equal legs, is `known` from the first.

    Examples
    --------
    >>> plain({"a": 0.5})
    ['mapping', ['a'], {'a': '0x1.0000000000000p-1'}]
    >>> plain([1.0]) == plain([1.0 + 1e-15])
    False
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
            each = ((name, plain(getattr(thing, name), known)) for name in _names(kind))
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


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def differences(one: Any, other: Any, where: str) -> Iterator[str]:
    """Where two descriptions by `plain` differ, and the values that stand there.

    Examples
    --------
    >>> list(differences(plain({"k": [1.0, 2.0]}), plain({"k": [1.0, 3.0]}), "robot"))
    ['robot.k[1]: 2.0, now 3.0']
    """
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
