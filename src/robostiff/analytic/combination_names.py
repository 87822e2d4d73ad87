"""Names for polynomials, and other polynomials written through them."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition
from robostiff.analytic.factors import Product, rational, starts_with_minus
from robostiff.analytic.field import ExactField
from robostiff.analytic.squares import completed_squares, is_positive_form


class CombinationNames:
    """Gives names to polynomials and writes others through them.

    Parameters
    ----------
    field : ExactField
    taken : set of str
        Names that are not to be given.

    Attributes
    ----------
    definitions : list of Definition
        The names so far.

    Examples
    --------
    >>> R, r, h = sp.symbols("R r h", positive=True)
    >>> field = ExactField([R, r, h])
    >>> names = CombinationNames(field, set())
    >>> names.give(field.element(R - r).num)
    >>> names.polynomial(field.element((R - r) ** 2 + h**2).num)
    d_a**2 + h**2
    """

    def __init__(self, field: ExactField, taken: set[str]) -> None:
        self._field = field
        self._taken = taken
        self.definitions: list[Definition] = []
        # Polynomials that have a name, and their expressions in names: d_a, L_a**2.
        self._named: list[tuple[Any, Any]] = []
        self._roots: dict[Any, Any] = {}

    def give(self, base: Any) -> None:
        """Name a polynomial, in terms of those that have one already."""
        field = self._field
        if starts_with_minus(field.polynomial_expression(base)):
            base = -base
        expression = field.polynomial_expression(base)
        inside, root = self.polynomial(base), sp.sqrt(expression)
        if root in field.generators or is_positive_form(field, base):
            symbol = sp.Symbol(self._free("L"), positive=True)
            self._roots[root] = symbol
            self.definitions.append(Definition(symbol, sp.sqrt(inside)))
            self._named.append((base, symbol**2))
        else:
            symbol = sp.Symbol(self._free(_letter(field, base)), **_assumed(expression))
            self.definitions.append(Definition(symbol, inside))
            self._named.append((base, symbol))

    def sum_of(self, products: list[Product]) -> sp.Expr:
        """A sum of products in names."""
        return sp.Add(*(self._product(product) for product in products))

    def polynomial(self, polynomial: Any) -> Any:
        """A polynomial through named ones where that is shorter: d_a**2 + h**2."""
        for known, written in self._named:
            ratio = _ratio(polynomial, known)
            if ratio is not None:
                return ratio * written
        # Squares first: of two that are as short, (x + y)**2 reads better than L_a**2 + 4*x*y.
        candidates = [self._by_squares(polynomial), self._by_names(polynomial)]
        return min(candidates, key=lambda written: int(written.count_ops()))

    def _by_squares(self, polynomial: Any) -> Any:
        squares, rest = completed_squares(self._field, polynomial)
        parts = [number * self.polynomial(square) ** 2 for square, number in squares]
        return sp.Add(*parts, self._plain(rest))

    def _by_names(self, polynomial: Any) -> Any:
        """What is left when multiples of named polynomials are taken out, one after the other."""
        rest, parts = polynomial, []
        for known, written in self._named:
            for power in (2, 1):
                if known.total_degree() * power > polynomial.total_degree():
                    continue
                rest, part = _without(rest, known**power, written**power)
                parts += part
        return sp.Add(*parts, self._plain(rest))

    def _product(self, product: Product) -> sp.Expr:
        factors = [self._factor(base, exponent) for base, exponent in product.powers]
        return sp.Mul(product.number, *factors)

    def _factor(self, base: Any, exponent: int) -> Any:
        written = self.polynomial(base)
        return sp.Pow(written, exponent)

    def _plain(self, polynomial: Any) -> Any:
        return self._field.polynomial_expression(polynomial).xreplace(self._roots)

    def _free(self, letter: str) -> str:
        number = 0
        while f"{letter}_{_suffix(number)}" in self._taken:
            number += 1
        name = f"{letter}_{_suffix(number)}"
        self._taken.add(name)
        return name


def _without(polynomial: Any, known: Any, written: Any) -> tuple[Any, list[Any]]:
    """Take out the multiple of a known polynomial that leaves the fewest terms."""
    counts = dict(polynomial.terms())
    leading, coefficient = next(iter(known.terms()))
    if leading not in counts:
        return polynomial, []
    number = counts[leading] / coefficient
    rest = polynomial - known * number
    if len(rest) + 1 >= len(polynomial):
        return polynomial, []
    return rest, [rational(number) * written]


def _ratio(a: Any, b: Any) -> sp.Expr | None:
    """The number a / b, where it is one."""
    number = a.leading_coefficient() / b.leading_coefficient()
    return rational(number) if a == b * number else None


def _letter(field: ExactField, base: Any) -> str:
    used = [g for g, d in zip(field.generators, base.degrees(), strict=True) if d]
    lengths = [g for g in used if g.is_Symbol]
    places = [field.generators.index(g) for g in lengths]
    if not lengths or any(sum(powers[p] for p in places) != 1 for powers, _ in base.terms()):
        return "p"
    return "k" if all(str(g)[0] in "kK" for g in lengths) else "d"


def _assumed(expression: Any) -> dict[str, bool]:
    """What is known of a combination: a positive or at least a real number."""
    if expression.is_positive:
        return {"positive": True}
    return {"real": True} if expression.is_real else {}


def _suffix(number: int) -> str:
    """a, b, ..., z, aa, ab, ..."""
    letters = ""
    number += 1
    while number:
        number, place = divmod(number - 1, 26)
        letters = chr(ord("a") + place) + letters
    return letters
