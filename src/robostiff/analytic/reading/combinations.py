"""Names for combinations that recur in a matrix, such as d_a = R - r and L_a^2 = d_a^2 + h^2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import product
from typing import Any

import sympy as sp

from robostiff.analytic.exact.definition import Definition, count_of, used_definitions
from robostiff.analytic.exact.element import root_of
from robostiff.analytic.exact.factors import (
    Product,
    bound_of_terms,
    completed_squares,
    is_positive_form,
    product_of,
    rational,
    starts_with_minus,
)
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.reading.rewriting import free_names
from robostiff.errors import InputError
from robostiff.frozen import frozen


class CombinationNames:
    """Gives names to polynomials and writes others through them.

    `taken`: names that are not to be given; `definitions`: the names so far.
    """

    def __init__(self, field: ExactField, taken: set[str]) -> None:
        self._field = field
        self._taken = taken
        self.definitions: list[Definition] = []
        # Polynomials that have a name, and their expressions in names: d_a, L_a**2.
        self._named: list[tuple[Any, Any]] = []
        self._roots: dict[Any, Any] = {}

    def give(self, base: Any) -> None:
        """Name a polynomial, in terms of named ones."""
        field = self._field
        if starts_with_minus(field.polynomial_expression(base)):
            base = -base
        expression = field.polynomial_expression(base)
        inside, root = self.polynomial(base), root_of(expression)
        if root in field.generators or is_positive_form(field, base):
            symbol = self._symbol("L", positive=True)
            self._roots[root] = symbol
            self.definitions.append(Definition(symbol, root_of(inside)))
            self._named.append((base, symbol**2))
        else:
            # Of a sum with a minus SymPy knows no sign, and takes long to find out.
            has_minus = any(x.could_extract_minus_sign() for x in expression.args)
            is_positive = not has_minus and expression.is_positive
            assumed = {"positive": True} if is_positive else {"real": True}
            used = [g for g, d in zip(field.generators, base.degrees(), strict=True) if d]
            lengths = [g for g in used if g.is_Symbol]
            places = [field.generators.index(g) for g in lengths]
            is_linear = all(sum(powers[p] for p in places) == 1 for powers, _ in base.terms())
            of_springs = all(str(g)[0] in "kK" for g in lengths)
            letter = ("k" if of_springs else "d") if lengths and is_linear else "p"
            symbol = self._symbol(letter, **(assumed if expression.is_real else {}))
            self.definitions.append(Definition(symbol, inside))
            self._named.append((base, symbol))

    def _symbol(self, letter: str, **assumed: bool) -> sp.Symbol:
        name = next(free_names(letter, self._taken))
        self._taken.add(name)
        return sp.Symbol(name, **assumed)

    def sum_of(self, products: list[Product]) -> sp.Expr:
        """A sum of products in names."""
        return sp.Add(
            *(
                sp.Mul(rational(number), *(self.polynomial(base) ** n for base, n in powers))
                for number, powers in products
            )
        )

    def polynomial(self, polynomial: Any) -> Any:
        """A polynomial through named ones where that is shorter: d_a**2 + h**2."""
        if len(polynomial) == 1:
            return self._plain(polynomial)
        for known, written in self._named:
            ratio = polynomial.leading_coefficient() / known.leading_coefficient()
            if polynomial == known * ratio:
                return rational(ratio) * written
        squares, rest = completed_squares(self._field, polynomial)
        parts = [number * self.polynomial(square) ** 2 for square, number in squares]
        by_squares = sp.Add(*parts, self._plain(rest))
        # The remainder after multiples of named polynomials are taken out, one after the other
        rest, parts = polynomial, []
        for (base, written), power in product(self._named, (2, 1)):
            if base.total_degree() * power > polynomial.total_degree():
                continue
            known, counts = base**power, dict(rest.terms())
            leading, coefficient = next(iter(known.terms()))
            if leading in counts:
                number = counts[leading] / coefficient
                remainder = rest - known * number
                if len(remainder) + 1 < len(rest):
                    rest, parts = remainder, [*parts, rational(number) * written**power]
        by_names = sp.Add(*parts, self._plain(rest))
        # Squares first: of two of equal length, (x + y)**2 is easier to read than L_a**2 + 4*x*y.
        return min(by_squares, by_names, key=count_of)

    def _plain(self, polynomial: Any) -> Any:
        return self._field.polynomial_expression(polynomial).xreplace(self._roots)


# Matrices beyond this would take seconds to factor.
_MOST_OPERATIONS = 15_000
_MOST_TERMS = 300


@frozen
class NamedCombinations:
    """A matrix in given symbols and in names for recurring sums."""

    matrix: sp.ImmutableMatrix
    definitions: tuple[Definition, ...]  # in given symbols and names defined before


def name_combinations(K: Any, taken: Iterable[str] = ()) -> NamedCombinations:
    """Name the sums that occur in more than one place of a symmetric or other matrix.

    Linear combinations are called d_a, d_b, ..., or k_a where stiffnesses are added; the roots of
    positive quadratic forms L_a, ..., so that L_a^2 stands for the form; anything else p_a, ...
    Each is a factor of entries or of their denominators. Entries that are too long to be factored,
    or not of exact arithmetic, stay as they are; so does a matrix that would not become shorter.

    Parameters
    ----------
    K : (m, n) SymPy matrix
    taken : iterable of str
        Names that are not to be given, besides those of the symbols of K.
    """
    K = sp.ImmutableMatrix(K)
    entries, unchanged = K.flat(), NamedCombinations(K, ())
    if not _is_manageable(entries):
        return unchanged
    try:
        field = ExactField(entries)
        written = {entry: _summands(field, entry) for entry in dict.fromkeys(entries)}
    except InputError:
        return unchanged
    if any(len(base) > _MOST_TERMS for s in written.values() for _, p in s for base, _ in p):
        return unchanged
    names = CombinationNames(field, {*taken, *(symbol.name for symbol in K.free_symbols)})
    products = [written[entry] for entry in entries]
    for base in _recurring(field, products, K):
        names.give(base)
    if not names.definitions:
        return unchanged
    # Multiplying it out may have made an entry longer than it was.
    shown = {x: min(names.sum_of(written[x]), x, key=count_of) for x in written}
    named = sp.ImmutableMatrix(K.rows, K.cols, [shown[entry] for entry in entries])
    definitions = used_definitions(names.definitions, [named])
    after = sum(map(count_of, [*named.flat(), *(d.expression for d in definitions)]))
    is_shorter = after < sum(map(count_of, entries))
    return NamedCombinations(named, definitions) if is_shorter else unchanged


def _is_manageable(entries: list[Any]) -> bool:
    """Whether the entries are short, also when multiplied out, and exact."""
    operations = 0
    for entry in dict.fromkeys(entries):
        operations += count_of(entry)
        if operations > _MOST_OPERATIONS or entry.has(sp.Float):
            return False
        for term in sp.Add.make_args(entry):
            bounds = [1, 1]  # above and below the fraction bar
            factors: Any = sp.Mul.make_args(term)
            for factor in factors:
                is_below = factor.is_Pow and factor.exp.is_number and factor.exp.is_negative
                bounds[bool(is_below)] *= bound_of_terms(factor, _MOST_TERMS)
            if max(bounds) > _MOST_TERMS:
                return False
    return True


def _summands(field: ExactField, entry: Any) -> list[Product]:
    """An entry as one product; a sum of fractions, one a leg, as one product each."""
    terms = sp.Add.make_args(entry)
    is_sum_of_legs = len(terms) > 1 and any(sp.denom(term).free_symbols for term in terms)
    by_denominator: dict[Any, Any] = {}
    for element in map(field.element, terms if is_sum_of_legs else [entry]):
        key = str(element.den)
        known = by_denominator.get(key)
        by_denominator[key] = element if known is None else known + element
    return [product_of(x.num, x.den) for x in by_denominator.values() if not x.is_zero]


def _recurring(field: ExactField, products: list[list[Product]], K: Any) -> list[Any]:
    """Sums that are factors in two or more places on or above the diagonal, short ones first."""
    is_symmetric = K.rows == K.cols and K.T == K
    places: Counter[str] = Counter()
    found: dict[str, Any] = {}

    def occurs(base: Any, times: int = 1) -> None:
        found.setdefault(str(base), base)
        places[str(base)] += times

    for i in range(K.rows):
        for j in range(i if is_symmetric else 0, K.cols):
            entry = products[i * K.cols + j]
            bases = {str(base): base for _, powers in entry for base, _ in powers}
            for base in bases.values():
                if len(base) > 1:
                    occurs(base)
    roots: list[Any] = [g for g in field.generators if g.is_Pow and g.free_symbols]
    for root in roots:
        factors = field.element(root.base).num.factor()[1]
        if len(factors) == 1:
            occurs(factors[0][0], times=2)
    for name in [name for name, times in places.items() if times > 1]:
        for square, _ in completed_squares(field, found[name])[0]:
            occurs(square)
    recurring = [found[name] for name, times in places.items() if times > 1]
    return sorted(recurring, key=lambda base: (base.total_degree() > 1, len(base), str(base)))
