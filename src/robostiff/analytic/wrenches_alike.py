"""Wrenches of all legs that meet one compliance: which of them are images of others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.named_reading import NamedReading
from robostiff.analytic.operation_count import count_of
from robostiff.analytic.orbits import COMPONENTS, Image, Orbit, orbits_of
from robostiff.analytic.sampled_leg import sampled
from robostiff.analytic.trigonometry import shortest_trigonometry
from robostiff.analytic.unit_wrenches import WrenchSearch
from robostiff.record import Entry

_LONG_ENTRY = 14  # operations of an entry of a wrench that is given a name
_SHORT = 6  # operations of an entry that stays


@dataclass(eq=False)
class WrenchOfLeg:
    """A wrench of a leg about the reference point, or the image of that of another leg."""

    at: np.ndarray  # (count, 6): at the samples
    write: Callable[[], list[Any]]  # returns its six entries

    @classmethod
    def of(cls, entries: list[Any], count: int) -> WrenchOfLeg:
        """One of known entries."""
        return cls(sampled(entries, count), lambda: entries)

    @cached_property
    def entries(self) -> list[Any]:
        """Its six entries."""
        return self.write()

    def turned(self, way: Image, search: WrenchSearch) -> WrenchOfLeg:
        """Its image, which is written where it is no image of others of its compliance."""

        def write() -> list[Any]:
            image = np.array(way.matrix, dtype=object) @ np.array(self.entries, dtype=object)
            pairs = zip(image, search.scale, strict=True)
            return [search.record.simplified(x, scale) for x, scale in pairs]

        return WrenchOfLeg(way.of(self.at), write)


@dataclass
class WrenchesAlike:
    """Wrenches of any legs that meet the same compliance; some are shifted by others."""

    compliance: Any
    wrenches: list[WrenchOfLeg] = field(default_factory=list)
    orbits: list[Orbit] | None = None
    in_names: set[int] = field(default_factory=set)
    shifted: set[int] = field(default_factory=set)

    def find_orbits(self, search: WrenchSearch, read: NamedReading) -> None:
        """Find which wrenches are turns of others, and name long entries of the first ones."""
        self.orbits = orbits_of(np.stack([w.at for w in self.wrenches], axis=1) / search.scale)
        count = len(self.wrenches)
        if self.orbits is None and not (read.in_short_steps or count == 1):
            return
        for i, own in self.needed.items():
            entries = {x.step: x for x in own if isinstance(x, Entry)}
            written = [read(x) for x in entries.values()]
            if i not in self.shifted:
                written = [shortest_trigonometry(x) for x in written]
            if max(map(count_of, written), default=0) > _LONG_ENTRY:
                self.in_names.add(i)
                for letter, x in zip(COMPONENTS, own, strict=True):
                    if isinstance(x, Entry) and count_of(read(x)) > _SHORT:
                        read.named(letter, x)

    @property
    def needed(self) -> dict[int, list[Any]]:
        """Entries of the wrenches of which the others are images, by their numbers."""
        count = range(len(self.wrenches))
        firsts = count if self.orbits is None else [orbit.first for orbit in self.orbits]
        return {i: self.wrenches[i].entries for i in firsts}

    def written(self, number: int, search: WrenchSearch, read: NamedReading) -> sp.ImmutableMatrix:
        """One of the wrenches, by the first of its orbit where that is shorter."""
        for orbit in self.orbits or ():
            if number in orbit.images and orbit.first in self.in_names:
                first = sp.Matrix([read(x) for x in self.wrenches[orbit.first].entries])
                turned = orbit.images[number].matrix * first
                return sp.ImmutableMatrix([turned[i] for i in search.space.rows])
        own = self.wrenches[number].entries
        return sp.ImmutableMatrix([read(own[i]) for i in search.space.rows])
