"""Parts in the world at many poses, of which some are taken."""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from typing import Any, Self

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.spatial import Screw

#: How many axes an array has behind those of the batch, by the name of its attribute.
_OWN_AXES = {
    **dict.fromkeys(("value", "coordinate"), 0),
    **dict.fromkeys(("axis", "point", "points", "start", "end", "centre"), 1),
    **dict.fromkeys(("origin", "reference_point"), 1),
    "rotation": 2,
}
_PLAIN = {str, int, float, bool, type(None)}


class BatchedPart:
    """A part in the world; its arrays may have an entry a pose, along their first axis."""

    def at(self, rows: int | slice) -> Self:
        """The same at one pose, or at some poses, of a batch along one axis."""
        return _at(self, None, rows)


def _at(value: Any, own_axes: int | None, rows: int | slice) -> Any:
    kind = type(value)
    if kind is np.ndarray:
        return value if own_axes is None else one_of(value, own_axes, rows)
    if kind is tuple:
        return tuple([_at(entry, own_axes, rows) for entry in value])
    if kind is Elasticity:
        return value.one(rows)
    if not issubclass(kind, (BatchedPart, Screw)):  # quicker than a union
        return value
    found, given = object.__new__(kind), vars(value)  # what holds at all poses does so at one
    attributes = vars(found)
    for name in names_of(kind):
        entry = attributes[name] = given[name]
        if (own := type(entry)) is np.ndarray:  # most are, and this is called often
            axes = _OWN_AXES.get(name)
            attributes[name] = entry if axes in (None, entry.ndim) else entry[rows]
        elif own not in _PLAIN:
            attributes[name] = _at(entry, _OWN_AXES.get(name), rows)
    return found


def one_of(values: np.ndarray, own_axes: int, index: int | slice) -> np.ndarray:
    """Values at some poses of a batch; those that are the same at all poses have no batch axis."""
    return values if values.ndim == own_axes else values[index]


@cache
def names_of(kind: Any) -> tuple[str, ...]:
    """Names of the attributes of a dataclass."""
    return tuple(field.name for field in fields(kind))
