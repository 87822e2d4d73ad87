"""Summary of a map: numbers of poses, statuses, and ranges of the quantities."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.analysis.maps.variables import EXCLUDED, Variable
from robostiff.elastostatics import Status


@dataclass(frozen=True)
class MapSummary:
    """Counts and ranges of some poses, of one block or of a whole map.

    Attributes
    ----------
    poses : int
        All of them, those excluded as well.
    statuses : mapping of int to int
        How many poses have each status.
    guarded : int
        Poses that a fast evaluator gave to the batched numeric form.
    ranges : mapping of str to (float, float)
        Smallest and largest value of each variable in one unit; none where no pose has an answer.
    """

    poses: int = 0
    statuses: Mapping[int, int] = field(default_factory=dict)
    guarded: int = 0
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def excluded(self) -> int:
        """Number of poses left out by `where`."""
        return self.statuses.get(EXCLUDED, 0)

    @property
    def computed(self) -> int:
        """Number of poses to compute."""
        return self.poses - self.excluded

    @property
    def reachable(self) -> int:
        """Poses asked for that all legs reach."""
        out = sum(n for code, n in self.statuses.items() if code & int(Status.UNREACHABLE))
        return self.computed - out

    @staticmethod
    def total(parts: Iterable[MapSummary]) -> MapSummary:
        """All of them together.

        Examples
        --------
        >>> one, other = MapSummary(2, {0: 2}), MapSummary(3, {0: 1, 64: 2})
        >>> MapSummary.total([one, other]).statuses
        {0: 3, 64: 2}
        """
        poses = guarded = 0
        statuses: dict[int, int] = {}
        ranges: dict[str, tuple[float, float]] = {}
        for part in parts:
            poses += part.poses
            guarded += part.guarded
            for code, count in part.statuses.items():
                statuses[code] = statuses.get(code, 0) + count
            for name, (low, high) in part.ranges.items():
                least, most = ranges.get(name, (low, high))
                ranges[name] = (min(low, least), max(high, most))
        return MapSummary(poses, dict(sorted(statuses.items())), guarded, ranges)

    def as_data(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "poses": self.poses,
            "statuses": {str(code): count for code, count in self.statuses.items()},
            "guarded": self.guarded,
            "ranges": {name: list(ends) for name, ends in self.ranges.items()},
        }

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> MapSummary:
        """From what `as_data` gave."""
        return cls(
            poses=data["poses"],
            statuses={int(code): count for code, count in data["statuses"].items()},
            guarded=data["guarded"],
            ranges={name: (low, high) for name, (low, high) in data["ranges"].items()},
        )


def summarize(
    arrays: Mapping[str, np.ndarray], variables: Iterable[Variable], guarded: int
) -> MapSummary:
    """Summary of a block.

    Parameters
    ----------
    arrays : mapping of str to (..., N) arrays
    variables : iterable of Variable
    guarded : int
    """
    status = arrays["status"]
    codes = np.bincount(status)
    ranges: dict[str, tuple[float, float]] = {}
    for variable in variables:
        # Smallest and largest entry of a matrix of four units mean nothing.
        if variable.is_float and variable.units and "," not in variable.units:
            values = arrays[variable.name]
            low, high = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
            if np.isfinite(low):
                ranges[variable.name] = (float(low), float(high))
    return MapSummary(
        poses=len(status),
        statuses={int(code): int(codes[code]) for code in np.flatnonzero(codes)},
        guarded=guarded,
        ranges=ranges,
    )
