"""Wrenches of all legs that meet one compliance, which are images of others, and their sum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.element import product_of
from robostiff.analytic.exact.operation_count import count_of
from robostiff.analytic.exact.products import FormulaTooLargeError
from robostiff.analytic.exact.trigonometry import shortest_trigonometry
from robostiff.analytic.placement.orbits import (
    COMPONENTS,
    Image,
    Orbit,
    Products,
    averages,
    orbits_of,
)
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.reading.record_reading import written_size
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.record import Entry, is_zero
from robostiff.recorded.leg import at_samples

_LONG_ENTRY = 14  # operations of an entry of a wrench that is given a name
_SHORT = 6  # operations of an entry that stays
#: Operations of all of K, beyond which it is not read at a glance.
PRINTED = 600
_FEW = 6  # products that are also written one by one
_MOST = 5000  # operations of a sum that is written out to see whether it becomes shorter
_PLAIN = 6  # operations of an entry that is not tried in another way


@dataclass(eq=False)
class WrenchOfLeg:
    """A wrench of a leg about the reference point, or the image of that of another leg."""

    at: np.ndarray  # (count, 6): at the samples
    write: Callable[[], list[Any]]  # returns its six entries

    @classmethod
    def of(cls, entries: list[Any], count: int) -> WrenchOfLeg:
        """One of known entries."""
        return cls(at_samples(entries, count), lambda: entries)

    @cached_property
    def entries(self) -> list[Any]:
        """Its six entries."""
        return self.write()

    def turned(self, way: Image, search: WrenchSearch) -> WrenchOfLeg:
        """Its image, which is written where it is no image of others of its compliance."""

        def write() -> list[Any]:
            pairs = zip(way.made_from(self.entries), search.scale, strict=True)
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
            if number in orbit.images and orbit.first in self.in_names and number != orbit.first:
                first = [read(x) for x in self.wrenches[orbit.first].entries]
                turned = orbit.images[number].made_from(first)
                return sp.ImmutableMatrix([turned[i] for i in search.space.rows])
        own = self.wrenches[number].entries
        return sp.ImmutableMatrix([read(own[i]) for i in search.space.rows])


def matrix_of(
    groups: list[WrenchesAlike],
    search: WrenchSearch,
    read: Callable[[Any], Any],
    squares: dict[Any, tuple[Any, Any]],
) -> sp.ImmutableMatrix | None:
    """The sum of all groups; None where that is long, as of many legs that are all different.

    An average of squares that is shorter by the unit length has a symbol: `squares` has both.
    """
    rows = list(search.space.rows)
    n = len(rows)
    total: dict[tuple[int, int], list[Any]] = {}
    operations = 0
    for group in groups:
        entries = averages(group.needed, group.orbits)
        others = _by_unit_length(group)
        known: dict[Any, Any] = {}
        below = 1 / group.compliance
        written: dict[Any, Any] = {}  # averages of x and of y are one
        for i in range(n):
            for j in range(i, n):
                place = rows[i], rows[j]
                key = *entries[place], sum(row > 2 for row in place)
                if key not in written:
                    written[key] = _written(entries[place], place, search, read)
                term = written[key]
                if place in others:
                    other = sp.Add(*(n * (1 - read(x) ** 2) for n, x in others[place]))
                    if count_of(other) < count_of(term):
                        symbol = sp.Symbol(f"average {other}", positive=True)
                        squares[symbol] = term, other
                        term = symbol
                if term not in known:
                    known[term] = product_of(term, below)
                    operations += count_of(known[term])
                    if operations > PRINTED:
                        return None
                total.setdefault((i, j), []).append(known[term])
    return sp.ImmutableMatrix(n, n, lambda i, j: sp.Add(*total.get((min(i, j), max(i, j)), ())))


def _written(
    products: Products, place: tuple[int, int], search: WrenchSearch, read: Callable[[Any], Any]
) -> Any:
    """A sum of products, simplified as a whole or product by product, whichever is shorter."""
    scale = search.length ** sum(i > 2 for i in place)
    total = _total(products, search, scale)
    if not isinstance(total, Entry):
        return read(total)
    apart = sp.Add(*(number * product_of(read(a), read(b)) for number, a, b in products))
    if count_of(apart) <= _PLAIN or (
        len(products) > _FEW and written_size(search.record, [total]) > _MOST
    ):
        return apart
    try:
        return min(apart, read(total), key=count_of)
    except FormulaTooLargeError:
        return apart


def _total(products: Products, search: WrenchSearch, scale: float) -> Any:
    """A sum of products; what two orbits have in common counts twice."""
    simplified = search.record.simplified
    total: Any = sp.Integer(0)
    by_number: dict[Any, Any] = {}
    for number, a, b in products:
        by_number[number] = by_number.get(number, sp.Integer(0)) + a * b
    for number, part in by_number.items():
        total = total + number * simplified(part, scale)
    return simplified(total, scale)


def _by_unit_length(group: WrenchesAlike) -> dict[tuple[int, int], list[tuple[Any, Any]]]:
    """Numbers n and entries x by which averages of two squares are n (1 - x^2): of unit couples.

    Squares of a force have its length below them, as other entries of K: they stay as they are.
    """
    found: dict[tuple[int, int], list[tuple[Any, Any]]] = {}
    needed = group.needed
    if group.shifted or not all(is_zero(f) for w in needed.values() for f in w[:3]):
        return found
    for orbit in group.orbits or ():
        one = sp.Rational(len(orbit.images), 2), needed[orbit.first][5]
        for row in (3, 4):
            found.setdefault((row, row), []).append(one)
    return found
