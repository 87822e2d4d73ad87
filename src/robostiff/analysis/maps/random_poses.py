"""Random poses, the same for the same seed, whichever block of them is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_source import read_coordinate
from robostiff.errors import InputError

# Philox makes four 64-bit numbers a step of its counter.
_PER_STEP = 4
_MOST = 2**63


@dataclass(frozen=True)
class RandomPoses:
    """Independent, uniformly distributed poses; coordinates left out stay at home.

    Pose i depends on the seed and on i alone (a counter-based generator), so that blocks can be
    made in any order, on any machine.

    Parameters
    ----------
    count : int
    ranges : mapping of str to (float, float)
        Lowest and highest value of each coordinate [m, rad], or quantities.
    seed : int

    Raises
    ------
    InputError

    Examples
    --------
    >>> poses = RandomPoses(1000, {"x": (-0.1, 0.1)}, seed=1)
    >>> some = poses.values((slice(2, 5),))
    >>> bool((some == poses.values((slice(0, 1000),))[:, 2:5]).all())
    True
    """

    count: int
    ranges: Mapping[str, tuple[float, float]]
    seed: int = 0
    units_given: Mapping[str, str] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        for name, value, least in (("count", self.count, 1), ("seed", self.seed, 0)):
            if not isinstance(value, int | np.integer) or not least <= value < _MOST:
                raise InputError(
                    f"{name} of random poses", got=value, expected=f"a whole number from {least} on"
                )
        if not self.ranges:
            raise InputError(
                "ranges of random poses",
                got="none",
                expected="at least one coordinate",
                hint='write {"x": (-0.1, 0.1)}',
            )
        ranges, units = {}, {}
        for name, given in self.ranges.items():
            subject, expected = f"range of {name!r}", "lowest and highest value"
            ends, unit = read_coordinate(subject, given, expected, name)
            if ends.shape != (2,) or ends[0] > ends[1]:
                raise InputError(subject, got=given, expected=expected)
            ranges[name] = (float(ends[0]), float(ends[1]))
            if unit:
                units[name] = unit
        object.__setattr__(self, "ranges", ranges)
        object.__setattr__(self, "units_given", units)

    @property
    def names(self) -> tuple[str, ...]:
        """Coordinates that vary."""
        return tuple(self.ranges)

    @property
    def dims(self) -> tuple[str, ...]:
        """One dimension."""
        return ("pose",)

    @property
    def shape(self) -> tuple[int, ...]:
        """How many poses there are."""
        return (int(self.count),)

    def values(self, part: tuple[slice, ...]) -> np.ndarray:
        """Coordinates of some of the poses (names, N)."""
        start, stop, _ = part[0].indices(int(self.count))
        block = np.empty((len(self.ranges), stop - start))
        for k, (low, high) in enumerate(self.ranges.values()):
            # One stream a coordinate; a pose is a place in it.
            stream = np.random.Philox(key=[self.seed, k])
            stream.advance(start // _PER_STEP)
            ahead = start % _PER_STEP
            block[k] = np.random.Generator(stream).random(stop - start + ahead)[ahead:]
            block[k] = low + (high - low) * block[k]
        return block

    def axis_values(self) -> Mapping[str, np.ndarray]:
        """Each pose has coordinates of its own."""
        return {}

    def parameter(self) -> None:
        """None: random poses have no parameter."""

    def description(self) -> Mapping[str, Any]:
        """Count, ranges and seed."""
        ranges = {name: tuple(map(float, ends)) for name, ends in self.ranges.items()}
        return {"kind": "random", "count": self.count, "ranges": ranges, "seed": self.seed}
