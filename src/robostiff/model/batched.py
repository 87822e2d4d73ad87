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


class BatchedPart:
    """A part in the world; its arrays may have an entry a pose, along their first axis."""

    def at(self, rows: int | slice) -> Self:
        """The same at one pose, or at some poses, of a batch along one axis."""
        return _at(self, None, rows)


def _at(value: Any, own_axes: int | None, rows: int | slice) -> Any:
    if isinstance(value, np.ndarray):
        return value if own_axes is None else one_of(value, own_axes, rows)
    if isinstance(value, tuple):
        return tuple(_at(entry, own_axes, rows) for entry in value)
    if isinstance(value, Elasticity):
        return value.one(rows)
    if not isinstance(value, BatchedPart | Screw):
        return value
    names = names_of(type(value))
    values = {name: _at(getattr(value, name), _OWN_AXES.get(name), rows) for name in names}
    return type(value)(**values)


def one_of(values: np.ndarray, own_axes: int, index: int | slice) -> np.ndarray:
    """Values at some poses of a batch; those that are the same at all poses have no batch axis."""
    return values if values.ndim == own_axes else values[index]


@cache
def names_of(kind: Any) -> tuple[str, ...]:
    """Names of the attributes of a dataclass."""
    return tuple(field.name for field in fields(kind))
