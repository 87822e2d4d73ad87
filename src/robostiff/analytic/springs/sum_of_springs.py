"""K = sum over the legs of W diag(1/c) W^T, each c a sum of contributions of named springs.

Nothing is multiplied out or brought over one denominator: a compliance stays a sum, and a wrench a
unit wrench. Legs that are turns of one another about the vertical count once, by their average.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.exact.closed import factored_fraction
from robostiff.analytic.exact.definition import (
    Definition,
    Unwritten,
    count_of,
    different_entries,
    operations_of,
    used_definitions,
)
from robostiff.analytic.placement.agreement import (
    COMPONENTS,
    Image,
    Orbit,
    Products,
    averages,
    orbits_of,
)
from robostiff.analytic.placement.robot_placement import PlacedRobot
from robostiff.analytic.reading.combinations import name_combinations
from robostiff.analytic.reading.named_reading import NamedReading
from robostiff.analytic.reading.record_reading import written_size
from robostiff.analytic.reading.rewriting import Written, shortest_trigonometry
from robostiff.analytic.reading.short_writing import shortest
from robostiff.analytic.springs.leg_springs import LegReader, NoUnitWrenchesError
from robostiff.analytic.springs.unit_wrenches import WrenchSearch
from robostiff.frozen import frozen
from robostiff.record import Entry, is_zero
from robostiff.recorded.elimination import cross
from robostiff.recorded.leg import at_samples
from robostiff.spatial import Space

_SAME = 1e-10


#: How a leg holds the platform: unit wrenches about the reference point, in names, and what each
#: meets, a name or a short formula.
LegInNames = tuple[Any, tuple[Any, ...]]


@frozen
class SumOfSprings:
    """Stiffness of a robot in names, and what the names stand for."""

    K: sp.ImmutableMatrix
    legs: Mapping[int, LegInNames]  # by leg number: those that are no images of others
    # lengths L, products EA of beams, compliances c; in the order in which they can be computed
    definitions: tuple[Definition, ...]

    def leg(self, first: int, way: Image | None = None) -> LegInNames:
        """One of these legs, or its image, of which the wrenches are not yet written."""
        first_wrenches, compliances = self.legs[first]
        if way is None:
            return first_wrenches, compliances
        rows = Space.of_size(self.K.rows).rows

        def shortest(x: Any) -> Any:
            return min(x, _in_names(factored_fraction(x), self.definitions), key=count_of)

        def turned() -> tuple[sp.ImmutableMatrix, ...]:
            wrenches = [dict(zip(rows, w, strict=True)) for w in first_wrenches]
            images = (way.made_from([w.get(i, 0) for i in range(6)]) for w in wrenches)
            return tuple(sp.ImmutableMatrix([shortest(w[i]) for i in rows]) for w in images)

        return Unwritten(turned), compliances


def sum_of_springs(
    placed: PlacedRobot, turned: Mapping[int, tuple[int, Image]] | None = None
) -> SumOfSprings | None:
    """Derive a placed robot leg by leg, without those that are known to be images of others.

    None where a leg has no basis of unit wrenches, and where a sum sign is shorter than the sum.

    Raises
    ------
    FormulaTooLargeError
        When a person would not print it.
    """
    search = WrenchSearch.of(placed)
    read = NamedReading(placed.record, placed.symbols, placed.springs)
    reader = LegReader(search, read)
    grouped = _groups(placed, turned or {}, search, reader)
    if grouped is None:
        return None
    groups, legs = grouped
    for group in groups:
        at = np.stack([w.at for w in group.wrenches], axis=1)
        group.orbits = orbits_of(at / search.scale)  # which wrenches are turns of others
    squares: dict[Any, Any] = {}
    entry: Callable[[Any], Any] = read
    if placed.follows.at_joints:
        entry = lambda x: shortest_trigonometry(read(x))  # noqa: E731
    K = matrix_of(groups, search, entry, squares)
    if K is None:
        return None
    taken = {*placed.symbols, *(d.symbol.name for d in read.definitions)}
    recurring = name_combinations(K, taken)
    K = shortest_trigonometry(recurring.matrix)
    inputs = set(placed.symbols.values())
    first = [d for d in recurring.definitions if d.expression.free_symbols <= inputs]
    last = [d for d in recurring.definitions if d not in first]
    lengths = [replace(d, expression=_in_names(d.expression, first)) for d in read.definitions]
    first, last = (
        [replace(d, expression=shortest_trigonometry(d.expression)) for d in those]
        for those in (first, last)
    )
    definitions, numbers = list[Definition](), dict[Any, Any]()
    for d in (*first, *lengths, *last):  # without numbers before sums
        expression: Any = d.expression.xreplace(numbers)
        number, rest = expression.as_coeff_Mul(rational=True)
        if rest.is_Add and number != 1:
            numbers[d.symbol], expression = number * d.symbol, rest
        definitions.append(replace(d, expression=expression))
    K = K.xreplace({s: _in_names(x, first) for s, x in squares.items()}).xreplace(numbers)

    def written(x: Any) -> Any:
        return _in_names(x, first).xreplace(numbers)

    rows = search.space.rows
    in_names = {
        number: (
            tuple(
                written(sp.ImmutableMatrix([read(g.wrenches[i].entries[k]) for k in rows]))
                for g, i in leg
            ),
            tuple(written(g.compliance) for g, _ in leg),
        )
        for number, leg in legs.items()
    }
    results = [K, *(x for leg in in_names.values() for parts in leg for x in parts)]
    found = SumOfSprings(K, in_names, used_definitions(definitions, results))
    found = _with_components(found, placed)
    formulas = *different_entries(found.K.flat()), *(d.expression for d in found.definitions)
    at_most = sum(map(count_of, formulas))
    if at_most > PRINTED and operations_of(found.K, found.definitions) > PRINTED:
        raise FormulaTooLargeError.beyond(PRINTED)
    return found


def _groups(
    placed: PlacedRobot,
    turned: Mapping[int, tuple[int, Image]],
    search: WrenchSearch,
    reader: LegReader,
) -> tuple[list[WrenchesAlike], dict[int, list[tuple[WrenchesAlike, int]]]] | None:
    """Wrenches by the compliance that they meet, and where those of each derived leg are."""
    groups: dict[Any, WrenchesAlike] = {}
    legs: dict[int, list[tuple[WrenchesAlike, int]]] = {}
    for i in range(len(placed.entries.legs)):
        if i in turned:
            first, way = turned[i]
            for group, number in legs[first]:
                if number in group.shifted:
                    group.shifted.add(len(group.wrenches))
                group.wrenches.append(group.wrenches[number].turned(way, search))
            continue
        try:
            wrenches = reader.of(placed.place(i).leg)
        except NoUnitWrenchesError:
            return None
        legs[i] = []
        for one in wrenches:
            key = tuple(map(float, one.sample))
            alike = next((k for k in groups if np.allclose(k, key, rtol=_SAME, atol=0)), key)
            group = groups.setdefault(alike, WrenchesAlike(one.compliance))
            legs[i].append((group, len(group.wrenches)))
            if len(one.parts) > 1:
                group.shifted.add(len(group.wrenches))
            about = one.seen_from(placed.reference, search)
            if placed.follows.at_joints:  # in its own joint coordinates by way of its end
                placed_leg, leg = placed.place(i), placed.entries.legs[i]
                w = one.seen_from(placed_leg.leg.end, search)
                away = np.array(leg.attachment.p, dtype=object) - placed.entries.reference_point
                moved = zip(w[3:], cross(placed_leg.platform.R @ away, w[:3]), strict=True)
                about = [*w[:3], *(b if is_zero(a) else a + b for a, b in moved)]
            at = at_samples(about, search.record.count)
            group.wrenches.append(WrenchOfLeg(at, lambda about=about: about))
    return list(groups.values()), legs


def _with_components(found: SumOfSprings, placed: PlacedRobot) -> SumOfSprings:
    """With names for components of unit vectors, and without idle ones, where that is shorter."""
    K, entries = found.K, different_entries(found.K.flat())
    others = [
        tuple(x)
        for leg in found.legs.values()
        for x in (*(w.flat() for w in leg[0]), *((c,) for c in leg[1]))
    ]
    for d in found.definitions:
        if d.expression.is_Add:
            put = {d.expression: d.symbol, -d.expression: -d.symbol}
            others = [tuple(x.xreplace(put) for x in one) for one in others]
    names = [COMPONENTS[i] for i in Space.of_size(K.rows).rows]
    plain = Written(tuple(entries), found.definitions, tuple(others))
    samples = {s: placed.record.input(name).sample for name, s in placed.symbols.items()}
    written = shortest(plain, placed.symbols, samples, names)
    put = dict(zip(entries, written.results, strict=True))
    put |= {-entry: -x for entry, x in put.items()}
    rest = iter(written.others)
    legs = {
        i: (
            tuple(sp.ImmutableMatrix(next(rest)) for _ in leg[0]),
            tuple(next(rest)[0] for _ in leg[1]),
        )
        for i, leg in found.legs.items()
    }
    matrix = sp.ImmutableMatrix(K.rows, K.cols, [put.get(x, x) for x in K.flat()])
    others = (x for one in written.others for x in one)
    used = used_definitions(written.definitions, [matrix, *others])
    return SumOfSprings(matrix, legs, used)


def _in_names(expression: Any, definitions: Sequence[Definition]) -> Any:
    """An expression or matrix with names for the sums that it contains as they are."""
    for d in definitions:
        if d.expression.is_Add:
            expression = expression.xreplace({d.expression: d.symbol, -d.expression: -d.symbol})
    return shortest_trigonometry(expression)


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

    @cached_property
    def entries(self) -> list[Any]:
        """Its six entries."""
        return self.write()

    def turned(self, way: Image, search: WrenchSearch) -> WrenchOfLeg:
        """Its image, which is written where it is no image of others of its compliance."""

        def write() -> list[Any]:
            pairs = zip(way.made_from(self.entries), search.scale, strict=True)
            return [search.record.simplify(x, scale) for x, scale in pairs]

        return WrenchOfLeg(way.of(self.at), write)


@dataclass
class WrenchesAlike:
    """Wrenches of any legs that meet the same compliance; some are shifted by others."""

    compliance: Any
    wrenches: list[WrenchOfLeg] = field(default_factory=list)
    orbits: list[Orbit] | None = None
    shifted: set[int] = field(default_factory=set)

    @property
    def needed(self) -> dict[int, list[Any]]:
        """Entries of the wrenches of which the others are images, by their numbers."""
        count = range(len(self.wrenches))
        firsts = count if self.orbits is None else [next(iter(orbit)) for orbit in self.orbits]
        return {i: self.wrenches[i].entries for i in firsts}


def matrix_of(
    groups: list[WrenchesAlike],
    search: WrenchSearch,
    read: Callable[[Any], Any],
    squares: dict[Any, Any],
) -> sp.ImmutableMatrix | None:
    """The sum of all groups; None where that is long, as of many legs that are all different.

    An average of squares that is shorter by the unit length has a symbol, and is in `squares`.
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
                    written[key] = _text_of(entries[place], place, search, read)
                term = written[key]
                if place in others:
                    other = sp.Add(*(n * (1 - read(x) ** 2) for n, x in others[place]))
                    if count_of(other) < count_of(term):
                        symbol = sp.Symbol(f"average {other}", positive=True)
                        squares[symbol] = other
                        term = symbol
                if term not in known:
                    known[term] = term * below
                    operations += count_of(known[term])
                    if operations > PRINTED:
                        return None
                total.setdefault((i, j), []).append(known[term])
    return sp.ImmutableMatrix(n, n, lambda i, j: sp.Add(*total.get((min(i, j), max(i, j)), ())))


def _text_of(
    products: Products, place: tuple[int, int], search: WrenchSearch, read: Callable[[Any], Any]
) -> Any:
    """A sum of products, simplified as a whole or product by product, whichever is shorter."""
    scale = search.length ** sum(i > 2 for i in place)
    total: Any = sp.Integer(0)
    by_number: dict[Any, Any] = {}  # what two orbits have in common counts twice
    for number, a, b in products:
        by_number[number] = by_number.get(number, sp.Integer(0)) + a * b
    for number, part in by_number.items():
        total = total + number * search.record.simplify(part, scale)
    total = search.record.simplify(total, scale)
    if not isinstance(total, Entry):
        return read(total)
    apart = sp.Add(*(number * read(a) * read(b) for number, a, b in products))
    if count_of(apart) <= _PLAIN or (
        len(products) > _FEW and written_size(search.record, [total]) > _MOST
    ):
        return apart
    try:
        return min(apart, read(total), key=count_of)
    except FormulaTooLargeError:
        return apart


def _by_unit_length(group: WrenchesAlike) -> dict[tuple[int, int], list[tuple[Any, Any]]]:
    """Numbers n and entries x by which averages of two squares are n (1 - x^2): of unit couples.

    Squares of a force have its length below them, as other entries of K: they stay as they are.
    """
    found: dict[tuple[int, int], list[tuple[Any, Any]]] = {}
    needed = group.needed
    if group.shifted or not all(is_zero(f) for w in needed.values() for f in w[:3]):
        return found
    for orbit in group.orbits or ():
        one = sp.Rational(len(orbit), 2), needed[next(iter(orbit))][5]
        for row in (3, 4):
            found.setdefault((row, row), []).append(one)
    return found
