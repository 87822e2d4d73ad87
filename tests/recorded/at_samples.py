"""Values of recorded entries at the samples of their record, and legs at recorded points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robostiff.model import PlacedBlock, PlacedLeg
from robostiff.record import Entry, Record
from robostiff.spatial import Space

COUNT = 3  # of the samples at recorded points


def sample(x: Any, k: int) -> float:
    """A number, or an entry at a sample."""
    return float(x.sample[k]) if isinstance(x, Entry) else float(x)


def samples(column: Sequence[Any] | np.ndarray, k: int) -> np.ndarray:
    """A column at a sample."""
    return np.array([sample(x, k) for x in column])


def symmetric(K: Mapping[tuple[int, int], Any], size: int, k: int = 0) -> np.ndarray:
    """A matrix at a sample, from its upper triangle."""
    return np.array(
        [[sample(K[min(i, j), max(i, j)], k) for j in range(size)] for i in range(size)]
    )


@dataclass(frozen=True)
class LegAtPoints:
    """A leg whose points are inputs of a record, near its own."""

    record: Record
    leg: PlacedLeg

    @classmethod
    def of(cls, leg: PlacedLeg, seed: int, space: Space = Space.SPATIAL) -> LegAtPoints:
        """Equal points share their inputs, so that redundant joints stay redundant."""
        rng, axes = np.random.default_rng(seed), range(3 if space is Space.SPATIAL else 2)
        number = {p: n for n, p in enumerate(sorted({tuple(e.point.tolist()) for e in leg.parts}))}
        record = Record(
            {
                f"p{n}{i}": p[i] + 0.05 * rng.uniform(-1, 1, COUNT)
                for p, n in number.items()
                for i in axes
            }
        )

        def recorded(point: np.ndarray) -> np.ndarray:
            n = number[tuple(point.tolist())]
            own = [record.input(f"p{n}{i}") if i in axes else point[i] for i in range(3)]
            return np.array(own, dtype=object)

        return cls(record, _with_points(leg, recorded))

    def at(self, k: int) -> PlacedLeg:
        """The leg in numbers, at a sample."""
        return _with_points(self.leg, lambda point: samples(point, k))


def _with_points(leg: PlacedLeg, place: Callable[[np.ndarray], np.ndarray]) -> PlacedLeg:
    elements = tuple(
        PlacedBlock(e.name, tuple(_with_points(branch, place) for branch in e.branches))
        if isinstance(e, PlacedBlock)
        else replace(e, point=place(e.point))
        for e in leg.elements
    )
    return PlacedLeg(leg.name, elements, leg.end)
