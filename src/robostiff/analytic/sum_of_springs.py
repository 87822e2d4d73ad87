"""K = sum over the legs of W diag(1/c) W^T, each c a sum of contributions of named springs.

Nothing is multiplied out or brought over one denominator: a compliance stays a sum, and a wrench a
unit wrench. Legs that are turns of one another about the vertical count once, by their average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.combinations import name_combinations
from robostiff.analytic.contributions import (
    BeamProducts,
    Contribution,
    ContributionReader,
    summed,
)
from robostiff.analytic.derivation import Definition
from robostiff.analytic.named_reading import NamedReading
from robostiff.analytic.products import FormulaTooLargeError
from robostiff.analytic.robot_placement import PlacedRobot
from robostiff.analytic.trigonometry import shortest_trigonometry
from robostiff.analytic.unit_wrenches import UnitWrench, WrenchSearch, sampled
from robostiff.model import PlacedLeg, PlacedSpring
from robostiff.record import Entry
from robostiff.spatial import Space

_SAME = 1e-10
_PRINTED = 600  # operations of all of K, beyond which nobody reads it at a glance
_FEW = 6  # products that are also written one by one
_SHORT = 6  # operations of a compliance of one spring that needs no name, such as l/EA


@dataclass(frozen=True)
class SpringLeg:
    """How a leg holds the platform, by its springs.

    Attributes
    ----------
    wrenches : tuple of sympy.ImmutableMatrix
        Unit wrenches about the reference point, in names.
    compliances : tuple of sympy.Expr
        What each meets: a name, or a short formula.
    redundant : tuple of bool
        Of its passive joints: whether they add no freedom to those before.
    """

    wrenches: tuple[sp.ImmutableMatrix, ...]
    compliances: tuple[Any, ...]
    redundant: tuple[bool, ...]


@dataclass(frozen=True)
class SumOfSprings:
    """Stiffness of a robot in names, and what the names stand for.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
    legs : tuple of SpringLeg
    definitions : tuple of Definition
        Lengths L, products EA of beams, compliances c; in the order in which they can be computed.
    """

    K: sp.ImmutableMatrix
    legs: tuple[SpringLeg, ...]
    definitions: tuple[Definition, ...]

    def written_out(self, expression: Any) -> Any:
        """An expression or matrix with what the names stand for."""
        for definition in reversed(self.definitions):
            if expression.has(definition.symbol):
                expression = expression.xreplace({definition.symbol: definition.expression})
        return expression


def operations_of(K: Any, definitions: Sequence[Definition]) -> int:
    """Operations of the different entries of a matrix, and of what its names stand for.

    Entries that differ by their sign count once, and numbers nothing.

    Examples
    --------
    >>> R, r, k, d = sp.symbols("R r k d")
    >>> operations_of(sp.Matrix([[k * d, 0], [0, -k * d]]), [Definition(d, R - r)])
    2
    """
    entries: set[Any] = set()
    for entry in K:
        if -entry not in entries:
            entries.add(entry)
    formulas = (*entries, *(d.expression for d in definitions))
    return sum(int(x.count_ops()) for x in formulas if x.free_symbols)


@dataclass
class _Group:
    """Wrenches of any legs that meet the same compliance."""

    compliance: Any
    wrenches: list[list[Any]] = field(default_factory=list)


def sum_of_springs(placed: PlacedRobot) -> SumOfSprings | None:
    """Derive a placed robot leg by leg; None where a leg has no basis of unit wrenches.

    Such are legs with parallel blocks, and those whose wrenches share energy.

    Raises
    ------
    FormulaTooLargeError
        When a person would not print it.
    """
    record, length = placed.record, placed.length
    space, reference = placed.entries.space, placed.reference
    search = WrenchSearch(record, reference, space, length)
    bases: list[tuple[UnitWrench, ...]] = []
    for own in placed.legs:
        basis = search.basis(own.leg)
        if basis is None:
            return None
        bases.append(basis)
    read = NamedReading(record, placed.symbols)
    reader = ContributionReader(record, length, read, BeamProducts(read))
    groups: dict[Any, _Group] = {}
    legs = []
    for own, basis in zip(placed.legs, bases, strict=True):
        wrenches, met = [], []
        for wrench in basis:
            w = wrench.about(reference, record, length)
            key = _met_at_samples(own.leg, wrench, search)
            alike = next((k for k in groups if np.allclose(k, key, rtol=_SAME, atol=0)), None)
            if alike is None:
                alike = key
                groups[key] = _Group(_named_compliance(reader.of(own.leg, wrench), read))
            groups[alike].wrenches.append(w)
            wrenches.append(sp.ImmutableMatrix([read(w[i]) for i in space.rows]))
            met.append(groups[alike].compliance)
        legs.append(SpringLeg(tuple(wrenches), tuple(met), search.redundant(own.leg)))
    K = _matrix(list(groups.values()), search, read)
    taken = {*placed.symbols, *(d.symbol.name for d in read.definitions)}
    recurring = name_combinations(K, taken)
    K = shortest_trigonometry(recurring.matrix)
    inputs = set(placed.symbols.values())
    first = [d for d in recurring.definitions if d.expression.free_symbols <= inputs]
    last = [d for d in recurring.definitions if d not in first]
    lengths = [Definition(d.symbol, _in_names(d.expression, first)) for d in read.definitions]
    legs = [
        replace(
            leg,
            wrenches=tuple(_in_names(w, first) for w in leg.wrenches),
            compliances=tuple(_in_names(c, first) for c in leg.compliances),
        )
        for leg in legs
    ]
    definitions, numbers = _without_numbers([*first, *lengths, *last])
    K = K.xreplace(numbers)
    legs = [
        replace(
            leg,
            wrenches=tuple(w.xreplace(numbers) for w in leg.wrenches),
            compliances=tuple(c.xreplace(numbers) for c in leg.compliances),
        )
        for leg in legs
    ]
    results = [K, *(x for leg in legs for x in (*leg.wrenches, *leg.compliances))]
    used = _used(results, definitions)
    if operations_of(K, used) > _PRINTED:
        raise FormulaTooLargeError.beyond(_PRINTED)
    return SumOfSprings(K, tuple(legs), used)


def _named_compliance(found: Sequence[Contribution], read: NamedReading) -> Any:
    """The sum of contributions, alike ones together, under a name where it is long."""
    total = summed(found)
    short = not total.is_Add and int(total.count_ops()) <= _SHORT
    return total if short else read.define("c", total)


def _met_at_samples(leg: PlacedLeg, wrench: UnitWrench, search: WrenchSearch) -> tuple[float, ...]:
    """The compliance in numbers, by which those of different legs are compared."""
    record, length = search.record, search.length
    total = np.zeros(record.count)
    for part in leg.own_parts:
        if isinstance(part, PlacedSpring):
            w = sampled(wrench.felt_by(part, record, length), record.count)
            C = sampled(part.elasticity.compliance, record.count)
            total += np.einsum("ni,nij,nj->n", w, C, w)
        elif part.stiffness is not None:
            both = sampled([wrench.work_on(part, record, length), part.stiffness], record.count)
            total += both[:, 0] ** 2 / both[:, 1]
    return tuple(map(float, total))


def _matrix(groups: list[_Group], search: WrenchSearch, read: NamedReading) -> sp.ImmutableMatrix:
    rows = list(search.space.rows)
    n = len(rows)
    total: dict[tuple[int, int], list[Any]] = {}
    for group in groups:
        entries = _entries(group.wrenches, search)
        known: dict[Any, Any] = {}
        for i in range(n):
            for j in range(i, n):
                place = rows[i], rows[j]
                term = _written(entries[place], place, search, read)
                if term not in known:
                    known[term] = term / group.compliance
                total.setdefault((i, j), []).append(known[term])
    return sp.ImmutableMatrix(n, n, lambda i, j: sp.Add(*total.get((min(i, j), max(i, j)), ())))


_Products = list[tuple[Any, Any, Any]]  # number, and two entries


def _written(
    products: _Products, place: tuple[int, int], search: WrenchSearch, read: NamedReading
) -> Any:
    """A sum of products, simplified as a whole or product by product, whichever is shorter."""
    scale = search.length ** sum(i > 2 for i in place)
    total: Any = sum((number * (a * b) for number, a, b in products), sp.Integer(0))
    total = search.record.simplified(total, scale)
    if not isinstance(total, Entry):
        return read(total)
    found = [read(total)]
    if int(found[0].count_ops()) > _SHORT and len(products) <= _FEW:
        found.append(sp.Add(*(number * (read(a) * read(b)) for number, a, b in products)))
    return min(found, key=lambda e: int(e.count_ops()))


def _entries(wrenches: list[list[Any]], search: WrenchSearch) -> dict[tuple[int, int], _Products]:
    """Products whose sum is that of w w^T, by averages where the wrenches are turns of one."""
    orbits = _orbits(wrenches, search) if search.space is Space.SPATIAL else None
    M: dict[tuple[int, int], _Products] = {(i, j): [] for i in range(6) for j in range(i, 6)}
    if orbits is None:
        for w in wrenches:
            for (i, j), products in M.items():
                products.append((1, w[i], w[j]))
        return M
    count = sp.Integer(len(wrenches)) / len(orbits)
    half = count / 2
    for f1, f2, f3, m1, m2, m3 in orbits:
        for place, products in {
            (0, 0): [(half, f1, f1), (half, f2, f2)],
            (1, 1): [(half, f1, f1), (half, f2, f2)],
            (2, 2): [(count, f3, f3)],
            (3, 3): [(half, m1, m1), (half, m2, m2)],
            (4, 4): [(half, m1, m1), (half, m2, m2)],
            (5, 5): [(count, m3, m3)],
            (0, 3): [(half, f1, m1), (half, f2, m2)],
            (1, 4): [(half, f1, m1), (half, f2, m2)],
            (0, 4): [(half, f1, m2), (-half, f2, m1)],
            (1, 3): [(-half, f1, m2), (half, f2, m1)],
            (2, 5): [(count, f3, m3)],
        }.items():
            M[place] += products
    return M


def _orbits(wrenches: list[list[Any]], search: WrenchSearch) -> list[list[Any]] | None:
    """One wrench of each set that turns by equal parts, three or more, map onto itself."""
    count = len(wrenches)
    G = sampled(wrenches, search.record.count) / np.array([1.0] * 3 + [search.length] * 3)
    for N in (n for n in range(count, 2, -1) if count % n == 0):
        left = list(range(count))
        firsts = []
        while left:
            first = left[0]
            own = {first}
            for k in range(1, N):
                c, s = np.cos(2 * np.pi * k / N), np.sin(2 * np.pi * k / N)
                turn = np.kron(np.eye(2), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
                image = G[:, first] @ turn.T
                alike = [i for i in left if i not in own and _is_image(G[:, i], image)]
                own.update(alike[:1])
            if len(own) < N:
                break
            firsts.append(wrenches[first])
            left = [i for i in left if i not in own]
        if not left:
            return firsts
    return None


def _is_image(own: np.ndarray, image: np.ndarray) -> bool:
    return any(bool(np.max(np.abs(own - sign * image)) < _SAME) for sign in (1, -1))


def _in_names(expression: Any, definitions: Sequence[Definition]) -> Any:
    """An expression or matrix with names for the sums that it contains as they are."""
    for d in definitions:
        if d.expression.is_Add:
            expression = expression.xreplace({d.expression: d.symbol, -d.expression: -d.symbol})
    return shortest_trigonometry(expression)


def _without_numbers(
    definitions: Sequence[Definition],
) -> tuple[list[Definition], dict[sp.Symbol, Any]]:
    """Definitions in their shortest form without numbers before sums, and what their names were."""
    found, numbers = [], {}
    for d in definitions:
        expression = shortest_trigonometry(d.expression.xreplace(numbers))
        number, rest = expression.as_coeff_Mul(rational=True)
        if rest.is_Add and number != 1:
            numbers[d.symbol], expression = number * d.symbol, rest
        found.append(Definition(d.symbol, expression))
    return found, numbers


def _used(results: list[Any], definitions: Sequence[Definition]) -> tuple[Definition, ...]:
    """The definitions that results need, in order."""
    wanted = set().union(*(x.free_symbols for x in results))
    kept = []
    for definition in reversed(definitions):
        if definition.symbol in wanted:
            kept.append(definition)
            wanted |= definition.expression.free_symbols
    return tuple(reversed(kept))
