"""The sum of w w^T / c over wrenches in names, by averages where they are turns of one another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from robostiff.analytic.operation_count import count_of
from robostiff.analytic.orbits import Products, averages
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.record_reading import written_size
from robostiff.analytic.unit_wrenches import WrenchSearch
from robostiff.analytic.wrenches_alike import WrenchesAlike
from robostiff.record import Entry, is_zero

#: Operations of all of K, beyond which it is not read at a glance.
PRINTED = 600
_FEW = 6  # products that are also written one by one
_MOST = 5000  # operations of a sum that is written out to see whether it becomes shorter
_SHORT = 6  # operations of an entry that is not tried in another way


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
        for i in range(n):
            for j in range(i, n):
                place = rows[i], rows[j]
                term = _written(entries[place], place, search, read)
                if place in others:
                    other = sp.Add(*(n * (1 - read(x) ** 2) for n, x in others[place]))
                    if count_of(other) < count_of(term):
                        symbol = sp.Symbol(f"average {other}", positive=True)
                        squares[symbol] = term, other
                        term = symbol
                if term not in known:
                    known[term] = term / group.compliance
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
    apart = sp.Add(*(number * (read(a) * read(b)) for number, a, b in products))
    if count_of(apart) <= _SHORT or (
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
