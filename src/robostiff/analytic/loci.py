"""Where the rank of a derivation in named steps drops, and where it decouples.

K = W diag(1/c) W^T loses rank where the wrenches W do, or where a spring in c has no stiffness.
By Cauchy and Binet all minors of K of its rank are sums of minors of W, of which the common factors
are sought. Lengths and other roots stay names, so that all is a polynomial. Factors that vanish
nowhere, or only where others do, are seen at samples.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.exact.definition import (
    Condition,
    count_of,
    in_given_symbols,
    used_definitions,
)
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.exact.factors import (
    bound_of_terms,
    common_denominator,
    common_factor,
    is_positive_form,
    over,
    product_of,
    shared_factors,
    without_sign,
)
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.placement.robot_pose import exact_angle
from robostiff.frozen import frozen
from robostiff.spatial import Space

_LONGEST = (2000, 20, 3)  # terms of a step that is written out; fewer where minors are too long
_MOST_MINORS = 2000
_LARGEST = 1000  # terms of a minor that is factored, as FLINT's calls cannot be stopped
_PRODUCTS = (200_000, 5_000_000)  # of terms, on the way to all minors; in given symbols
_RANK = 1e-8  # of the largest singular value
_SEED = 11


def written_steps(derivation: Derivation, longest: float = _LONGEST[0]) -> Callable[[Any], Any]:
    """Writes expressions in given symbols and in names of roots, and of steps that are too long.

    `longest`: terms of a step that is written out; infinity for all of them, roots as well.
    """
    full: dict[Any, Any] = {}
    for d in of_legs(derivation).definitions:
        expression: Any = d.expression.xreplace(full)
        powers = expression.atoms(sp.Pow)
        has_root = any(not p.exp.is_Integer and p.free_symbols for p in powers)
        is_short = not has_root and bound_of_terms(expression, _LONGEST[0]) <= longest
        if longest == math.inf or is_short:
            full[d.symbol] = expression
    return lambda x: x.xreplace(full)


def of_legs(derivation: Any) -> Any:
    """The names and legs of a robot's derivation: those by springs where it has such."""
    return getattr(derivation, "named", None) or derivation


#: Irreducible factors that vanish where a stiffness loses rank, with their exponents in the minors
#: of K, and why they were not looked for; empty otherwise.
Locus = tuple[dict[Any, int], str]


def rank_locus(derivation: RobotDerivation, rank: int) -> Locus:
    """Common factors of all minors of K of its rank, for a robot's derivation in names.

    `rank`: of K in general.

    Raises
    ------
    FormulaTooLargeError
        When a minor is too long to be factored.
    """
    form = of_legs(derivation)
    n = form.K.rows
    if rank == 0:
        return {}, ""
    if any(not leg.joints and len(leg.wrenches) == n for leg in form.legs):
        return {}, "a leg without passive joints holds it in all directions" * (form is derivation)
    if not any(leg.wrenches for leg in form.legs):
        return {}, "where it drops is not searched: it is where that of a module does"
    minors = math.comb(sum(len(leg.wrenches) for leg in form.legs), rank)
    minors *= math.comb(n, rank)
    if minors > _MOST_MINORS:
        return {}, f"where it drops is not searched in {minors} minors of its wrenches"
    for longest in (*[math.inf] * (form is not derivation), *_LONGEST[:-1]):
        with suppress(FormulaTooLargeError):
            return _locus(derivation, longest, rank)
    return _locus(derivation, _LONGEST[-1], rank)


def _locus(derivation: RobotDerivation, longest: float, rank: int) -> Locus:
    written, form = written_steps(derivation, longest), of_legs(derivation)
    W = [written(w) for leg in form.legs for w in leg.wrenches]
    c = [written(x) for leg in form.legs for x in leg.compliances]
    if rank_in_numbers(W) != rank:
        return {}, _HIDDEN
    field = ExactField([x for w in W for x in w])
    each = [_without_denominator(field, w) for w in W]
    rows, poles = [row for row, *_ in each], list[Counter[Any]]()
    no_zeros, below_compliances = set[Any](), set[Any]()
    for (_, above, below, square), x in zip(each, c, strict=True):
        order = Counter({zero: -2 * n for zero, n in _orders(field, below).items()})
        order.subtract(_irreducible(square))
        if form is derivation:  # of any length; wrenches made conjugate have denominators
            no_zeros |= order.keys()
            order.update(below_x := _orders(f := ExactField([x]), f.element(x).den))
            below_compliances |= below_x.keys()
        else:
            order.update({zero: 2 * n for zero, n in _orders(field, above).items()})
            order.subtract(_irreducible(x))
        poles.append(order)
    # No term cancels another: minors of K are as small as the largest of them.
    orders: list[Counter[Any]] = []
    for places, minors in _minors(field, rows, rank, _PRODUCTS[longest == math.inf]):
        order = _orders(field, common_factor(minors))
        for i in places:
            order.update({zero: n / 2 for zero, n in poles[i].items()})
        orders.append(order)
    least = {x: 2 * min(order[x] for order in orders) for x in set().union(*orders)}
    factors = {zero: int(n) for zero, n in least.items() if n > 0 and zero not in no_zeros}
    names = {d.symbol for d in form.definitions}
    of_names = {factor for factor in factors if factor.free_symbols & names}
    if of_names & below_compliances:  # what is above may vanish with it, within a name
        return {}, _HIDDEN
    return factors, "in names of its steps" * bool(of_names)


_HIDDEN = "where it drops is hidden by the names of its steps"


def rank_in_numbers(W: Sequence[Any]) -> int:
    """Rank of wrenches at random values of all symbols and names."""
    if not W:
        return 0
    M = sp.Matrix.hstack(*map(sp.Matrix, W))
    symbols = sorted(M.free_symbols, key=str)
    random = np.random.default_rng(_SEED)
    values = random.uniform(0.5, 1.5, len(symbols))
    numbers = np.array(sp.lambdify(symbols, M, "numpy")(*values.astype(complex)), dtype=complex)
    numbers /= np.linalg.norm(numbers, axis=0)
    return int(np.linalg.matrix_rank(numbers, tol=_RANK))


def _without_denominator(field: ExactField, wrench: Any) -> tuple[list[Any], Any, Any, Any]:
    """A wrench as polynomials without a common factor, and what it is beside these.

    That are a factor above and one below, and the square of a length that all entries are divided
    by: beside sines it would not be seen as a common factor.
    """
    powers = [x.as_powers_dict() for x in wrench if x != 0]
    least = {x: max(p.get(x, 0) for p in powers) for x in set().union(*powers) if x.is_Add}
    length = sp.Mul(*(x**-n for x, n in least.items() if n < 0))
    elements = [field.element(x) for x in length * wrench]
    below = common_denominator(field, elements)
    entries = [field.reduce(over(x, below)) for x in elements]
    above = common_factor(entries)
    return [x if x.is_zero() else x / above for x in entries], above, below, length**2


def _minors(
    field: ExactField, rows: Sequence[Sequence[Any]], size: int, most: int
) -> Iterator[tuple[tuple[int, ...], list[Any]]]:
    """All minors of a size but zeros, those of some rows by those of fewer of them.

    `most`: products of terms on the way.
    """
    products = 0
    for places in combinations(range(len(rows)), size):
        chosen = [rows[i] for i in places]
        n = len(chosen[0])
        known: dict[tuple[int, ...], Any] = {(j,): chosen[0][j] for j in range(n)}
        for k, row in enumerate(chosen[1:], start=1):
            larger = {}
            for columns in combinations(range(n), k + 1):
                total = field.ring.constant(0)
                for place, j in enumerate(columns):
                    rest = known[(*columns[:place], *columns[place + 1 :])]
                    if row[j].is_zero() or rest.is_zero():
                        continue
                    products += len(row[j]) * len(rest)
                    if products > most:
                        raise FormulaTooLargeError.beyond(_LARGEST)
                    product = row[j] * rest
                    total = total - product if (k + place) % 2 else total + product
                larger[columns] = field.reduce(total)
            known = larger
        minors = [minor for minor in known.values() if not minor.is_zero()]
        if any(len(minor) > _LARGEST for minor in minors):
            raise FormulaTooLargeError.beyond(_LARGEST)
        if minors:
            yield places, minors


def coupling_of(K: Any) -> list[Any]:
    """Entries of a matrix between translations and rotations."""
    t = Space.of_size(K.rows).translations
    return list(K[:t, t:])


def shared_zeros(entries: Sequence[Any]) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries share; 0 where all of them are zero."""
    field = ExactField(entries)
    elements = [x for x in map(field.element, dict.fromkeys(entries)) if not x.is_zero]
    if not elements:
        return (sp.Integer(0),)
    factors = shared_factors(field, map(field.zeros, elements))
    return tuple(sorted(factors, key=sp.default_sort_key))


def decoupling_in_steps(derivation: Derivation) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries between translations and rotations share.

    Raises
    ------
    FormulaTooLargeError
        When entries are too long to be written out.
    """
    entries, full, most = coupling_of(derivation.K), dict[Any, Any](), _LONGEST[0]
    for d in used_definitions(derivation.definitions, entries):
        full[d.symbol] = d.expression.xreplace(full)
        if bound_of_terms(full[d.symbol], most) > most:
            raise FormulaTooLargeError.beyond(most)
    return shared_zeros([x.xreplace(full) for x in entries])


def decoupling_in_names(derivation: RobotDerivation) -> tuple[sp.Expr, ...]:
    """The same of a sum of springs, of which each factor in names is written out by itself."""
    named, each = of_legs(derivation), list[set[Any]]()
    written = in_given_symbols(named.definitions)
    for entry in dict.fromkeys(x for x in coupling_of(named.K) if x != 0):
        field, total = ExactField([entry]), Counter[Any]()
        element = field.element(entry)
        for base, power in product_of(element.num, element.den)[1]:
            factor: Any = field.polynomial_expression(base)
            orders = _irreducible(factor.xreplace(written))
            total.update({zero: power * n for zero, n in orders.items()})
        each.append({zero for zero, n in total.items() if n > 0})
    shared = set.intersection(*each) if each else (sp.Integer(0),)
    return tuple(sorted(shared, key=sp.default_sort_key))


def _irreducible(expression: Any) -> Counter[Any]:
    """Irreducible factors in symbols and roots that may vanish, with their exponents."""
    found = Counter[Any]()
    # Each by itself: of a fraction without sines below, what is above would be multiplied.
    for part, sign in zip(sp.fraction(sp.together(expression)), (1, -1), strict=True):
        field = ExactField([part])
        orders = _orders(field, field.zeros(field.element(part)))
        found.update({zero: sign * n for zero, n in orders.items()})
    return found


def _orders(field: ExactField, polynomial: Any) -> Counter[Any]:
    """Irreducible factors that may vanish, with their exponents; halves of what is under roots."""
    found = Counter[Any]()
    for base, power in polynomial.factor()[1]:
        if is_positive_form(field, base):
            continue
        written: Any = field.polynomial_expression(base)
        number, zeros = sp.Integer(int(power)), Counter({without_sign(written): 1})
        if written.is_Pow and written.exp == sp.S.Half:
            number, zeros = number / 2, _irreducible(written.base)
        found.update({zero: number * n for zero, n in zeros.items() if zero.free_symbols})
    return found


_SAMPLES = 4000
_FEWEST = 100  # samples at which the conditions hold, for an answer by signs
_STARTS = 4
_STEPS = 100
_BESIDE = 1e-4  # from a point, to see a slope
# Of Newton's step: a zero without a change of sign is double.
_SHARES = 2.0 ** np.arange(1, -9, -1)
_ROUNDING = 1e-13  # of the sum of the sizes of its terms
_ZERO = 1e-10
_ALIKE = 1e-2  # the same of another factor at such a zero, of high order
_NEAR = 0.1  # a symbol there, of the largest
#: Operations beyond which a factor is long.
LONG = 60
_SEED_OF_SAMPLES = 29


def power_of_a_cosine(factor: Any) -> tuple[Any, int] | None:
    """A cosine, and its power, that a sum in sines and cosines of one angle is a number times."""
    turns = factor.atoms(sp.sin, sp.cos)
    angles = set().union(*(x.free_symbols for x in turns))
    if not factor.is_Add or factor.free_symbols != angles or len(angles) != 1:
        return None
    (x,) = angles
    at = np.linspace(0, 4 * np.pi, _TURNS, endpoint=False)  # of halves of the angle
    values = np.broadcast_to(values_of([factor], {x: at})[0], at.shape)
    waves = np.fft.fft(values)[: _TURNS // 2]
    top = int(np.flatnonzero(np.abs(waves) > _SAME * np.abs(waves).max())[-1])
    for power in (n for n in range(1, top + 1) if top % n == 0):
        for k in range(power):
            phase = (np.angle(waves[top]) + 2 * np.pi * k) / power
            wave = np.cos(top / power * at / 2 + phase) ** power
            number = values @ wave / (wave @ wave)
            if np.max(np.abs(values - number * wave)) <= _SAME * np.max(np.abs(values)):
                found = sp.cos(sp.Rational(top, 2 * power) * x + exact_angle(float(phase)))
                return (-found if found.could_extract_minus_sign() else found), power
    return None


_TURNS = 256
_SAME = 1e-9


@frozen
class Samples:
    """Random values of symbols, of their signs or of either, at which conditions hold."""

    symbols: tuple[sp.Symbol, ...]
    conditions: tuple[Condition, ...] = ()
    signed: bool = False  # whether positive symbols have positive values only

    @cached_property
    def values(self) -> np.ndarray:
        """Values (m, symbols) between 0.1 and 3 in size, spread evenly by their logarithms."""
        random = np.random.default_rng(_SEED_OF_SAMPLES)
        shape = _SAMPLES, len(self.symbols)
        values = np.exp(random.uniform(np.log(0.1), np.log(3.0), shape))
        if self.symbols:
            signs = random.choice([-1.0, 1.0], shape)
            values *= np.where(
                [self.signed and bool(x.is_positive) for x in self.symbols], 1, signs
            )
        for condition in self.conditions:
            known = dict(zip(self.symbols, values.T, strict=True))
            values = values[values_of([condition.expression], known)[0] > 0]
        return values

    def relative(self, factor: Any) -> Callable[[np.ndarray], np.ndarray]:
        """Values of a sum by the sizes of its terms, as a function of values (..., symbols)."""
        terms = sp.Add.make_args(sp.expand(factor))

        def ratio(at: np.ndarray) -> np.ndarray:
            known = dict(zip(self.symbols, np.moveaxis(at, -1, 0), strict=True))
            each = np.array([x + np.zeros(at.shape[:-1]) for x in values_of(terms, known)])
            sizes = np.sum(np.abs(each), axis=0)
            return np.sum(each, axis=0) / np.where(sizes > 0, sizes, 1)

        return ratio

    def zeros(self, factor: Any) -> np.ndarray | None:
        """Points (m, symbols) at which a factor is zero and changes no sign; None if it does.

        Empty for one that is not zero anywhere.
        """
        relative = self.relative(factor)
        values = relative(self.values)
        if len(values) < _FEWEST or max(values) > _ROUNDING < -min(values):
            return None
        at = self.values[np.argsort(np.abs(values))[:_STARTS]]
        size, n = np.abs(relative(at)), len(self.symbols)
        for _ in range(_STEPS):
            beside = at[:, None] + _BESIDE * np.stack([np.eye(n), -np.eye(n)])[:, None]
            up, down = np.abs(relative(beside))
            slope = (up - down) / (2 * _BESIDE)
            with np.errstate(all="ignore"):
                full = np.nan_to_num(slope * (size / np.sum(slope**2, axis=1))[:, None])
            ways = at - _SHARES[:, None, None] * full
            each = np.abs(relative(ways))
            best = np.argmin(each, axis=0), np.arange(len(at))
            is_less = each[best] < size
            if not np.any(is_less):
                break
            at, size = (
                np.where(is_less[:, None], ways[best], at),
                np.where(is_less, each[best], size),
            )
        positive = [i for i, s in enumerate(self.symbols) if self.signed and s.is_positive]
        return at[(size < _ZERO) & np.all(at[:, positive] > 0, axis=1)]

    def are_zeros(self, factors: Sequence[Any], at: np.ndarray) -> bool:
        """Whether one of the factors is nearly zero at a point."""
        small = {s for s, x in zip(self.symbols, at, strict=True) if abs(x) < _NEAR * abs(at).max()}
        return any(
            x in small if x.is_Symbol else abs(self.relative(x)(at)) < _ALIKE for x in factors
        )


def independent_zeros(factors: Sequence[Any]) -> tuple[Any, ...]:
    """Factors without those that are zero nowhere, or only where shorter ones are.

    Sines and cosines have a relation, so that a factor may be a multiple of another by a sum of
    squares without being divisible by it. A factor that changes its sign is kept; a long one where
    it does so for symbols of their signs.
    """
    symbols = tuple(sorted(set().union(*(x.free_symbols for x in factors)), key=str))
    kept: list[Any] = []
    for factor in sorted(factors, key=count_of):
        samples = Samples(symbols, signed=count_of(factor) > LONG)
        points = None if factor.is_Symbol else samples.zeros(factor)
        if points is None or any(not samples.are_zeros(kept, at) for at in points):
            kept.append(factor)
    return tuple(x for x in factors if x in kept)


def may_vanish(factor: Any, conditions: Sequence[Condition]) -> bool:
    """Whether a factor is zero for symbols of their signs where conditions hold, or beside it."""
    symbols = factor.free_symbols.union(*(c.expression.free_symbols for c in conditions))
    samples = Samples(tuple(sorted(symbols, key=str)), tuple(conditions), signed=True)
    points = samples.zeros(factor)
    return points is None or len(points) > 0
