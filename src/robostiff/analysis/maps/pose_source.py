"""Where the poses of a map come from: what grids, lists and random poses have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class PoseSource(Protocol):
    """Poses made block by block, never all at once."""

    @property
    def names(self) -> tuple[str, ...]:
        """The coordinates that it tells; the others stay at home."""
        ...

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions of the map."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the dimensions of the map."""
        ...

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of the poses of a block (names, ...) [m, rad]."""
        ...

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Values along a dimension named like its coordinate; none where each pose has its own."""
        ...

    def parameter(self) -> tuple[str, str, np.ndarray] | None:
        """Name, unit and values of what runs along the poses, such as time; or None."""
        ...

    def description(self) -> Mapping[str, Any]:
        """What makes it this source and no other."""
        ...
