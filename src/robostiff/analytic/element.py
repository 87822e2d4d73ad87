"""Elements of an exact field, canonical fractions of polynomials, and how these are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import sympy as sp

if TYPE_CHECKING:
    from robostiff.analytic.field import ExactField

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = ("product",)
_ONE = ("number", 1, 1)
_first = itemgetter(0)
#: A coefficient and the factors of a product, each a generator with its power.
_Term = tuple[tuple[str, int, int], list[tuple[int, int]]]


@dataclass(frozen=True)
class Element:
    """An element of an exact field: a canonical fraction of polynomials.

    Supports ``+ - * /``, integer powers and ``==`` with elements and integers.
    """

    field: ExactField
    num: Any
    den: Any

    @property
    def is_zero(self) -> bool:
        """Whether it is exactly zero."""
        return bool(self.num.is_zero())

    @property
    def has_unit_denominator(self) -> bool:
        """Whether it is a polynomial."""
        return bool(self.den.is_one())

    @property
    def terms(self) -> int:
        """Number of terms of numerator and denominator together."""
        return len(self.num) + len(self.den)

    def __add__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return b if self.is_zero else self
        if self.den == b.den:
            if self.den.is_one():
                return Element(self.field, self.num + b.num, self.den)
            return self.field.fraction(self.num + b.num, self.den)
        return self.field.fraction(self.num * b.den + b.num * self.den, self.den * b.den)

    def __mul__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        if self.is_zero or b.is_zero:
            return self.field.zero
        return self.field.fraction(self.num * b.num, self.den * b.den)

    def __truediv__(self, other: Element | int) -> Element:
        b = self._coerced(other)
        return self.field.fraction(self.num * b.den, self.den * b.num)

    def __neg__(self) -> Element:
        return Element(self.field, -self.num, self.den)

    def __sub__(self, other: Element | int) -> Element:
        return self + (-self._coerced(other))

    def __rsub__(self, other: int) -> Element:
        return self._coerced(other) - self

    def __rtruediv__(self, other: int) -> Element:
        return self._coerced(other) / self

    def __pow__(self, power: int) -> Element:
        base = self if power >= 0 else 1 / self
        num, den = base.num ** abs(power), base.den ** abs(power)
        if self.field.has_roots(num) or self.field.has_roots(den):
            return self.field.fraction(num, den)
        return Element(self.field, num, den)  # without a common factor, as before

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Element | int):
            return NotImplemented
        return (self - self._coerced(other)).is_zero

    __hash__ = None  # type: ignore[assignment]

    def _coerced(self, other: Element | int) -> Element:
        if isinstance(other, Element):
            return other
        return Element(self.field, self.field.ring.constant(other), self.field.ring.constant(1))


class PolynomialWriter:
    """Writes polynomials of some generators as SymPy expressions.

    SymPy sorts and merges the factors of every product and the terms of every sum anew. Of a
    polynomial the factors are known to be distinct, so that ranking each of them once is enough;
    the result is the same expression, arguments in the same order. Roots are left to SymPy, as
    they may merge with each other and with what they are roots of.

    `generators`: symbols, sines, cosines and roots.

    Examples
    --------
    >>> import flint
    >>> ring = flint.fmpq_mpoly_ctx.get(["x", "y"], flint.Ordering.lex)
    >>> x, y = ring.gens()
    >>> PolynomialWriter(sp.symbols("x y")).expression(3 * x**2 * y - y / 2 + 1)
    3*x**2*y - y/2 + 1
    """

    def __init__(self, generators: Sequence[Any]) -> None:
        self._generators = tuple(generators)
        self._merges = [not (g.is_Symbol or isinstance(g, sp.sin | sp.cos)) for g in generators]
        self._some_merge = any(self._merges)
        # The parts of products: generators to a power, and coefficients.
        self._parts: dict[Any, Any] = {_A_PRODUCT: _PRODUCT}
        self._ordered: list[Any] = [_PRODUCT]
        self._ranks: dict[Any, int] = {_A_PRODUCT: 0}

    def expression(self, polynomial: Any) -> sp.Expr:
        """The polynomial as a canonical sum of products."""
        return self.expressions([polynomial])[0]

    def expressions(self, polynomials: Sequence[Any]) -> list[Any]:
        """Several of them, whose factors are ranked together."""
        read = [self._read(polynomial) for polynomial in polynomials]
        needed = {factor for terms in read for _, factors in terms for factor in factors}
        parts = self._known_parts(needed.union([c for terms in read for c, _ in terms]))
        return [self._sum(terms, parts) for terms in read]

    def _read(self, polynomial: Any) -> list[_Term]:
        used = [place for place, degree in enumerate(polynomial.degrees()) if degree]
        return [
            (_number(c), [(i, powers[i]) for i in used if powers[i]])
            for powers, c in polynomial.terms()
        ]

    def _sum(self, terms: list[_Term], parts: dict[Any, Any]) -> Any:
        if self._some_merge and any(self._merges[i] for _, factors in terms for i, _ in factors):
            return sp.Add(*(sp.Mul(parts[c], *(parts[f] for f in fs)) for c, fs in terms))
        written = [self._product(c, factors) for c, factors in terms]
        if len(written) == 1:
            return written[0][1]
        written.sort(key=_first)
        whole: Any = sp.Add._from_args(tuple(term for _, term in written), True)
        return whole

    def _product(self, c: Any, factors: list[Any]) -> tuple[tuple[int, ...], Any]:
        """A product and the key that sorts it."""
        ranks, parts = self._ranks, self._parts
        if not factors:
            # A number leads its sum.
            return (-1,), parts[c]
        keys = sorted([ranks[factor] for factor in factors])
        if c != _ONE:
            keys.insert(0, ranks[c])
        if len(keys) == 1:
            return (keys[0],), parts[factors[0]]
        ordered = self._ordered
        product = sp.Mul._from_args(tuple([ordered[key] for key in keys]), True)
        return (ranks[_A_PRODUCT], len(keys), *keys), product

    def _known_parts(self, needed: set[Any]) -> dict[Any, Any]:
        """All parts written so far, those needed among them, and ranked."""
        parts = self._parts
        missing = [part for part in needed if part not in self._ranks]
        if missing:
            parts |= {part: self._written(part) for part in missing}
            self._ordered = sorted([*self._ordered, *(parts[x] for x in missing)], key=_IN_ORDER)
            place = {written: rank for rank, written in enumerate(self._ordered)}
            self._ranks = {part: place[parts[part]] for part in (*self._ranks, *missing)}
        return parts

    def _written(self, part: Any) -> Any:
        if len(part) == 2:
            place, power = part
            generator = self._generators[place]
            return generator if power == 1 else sp.Pow(generator, power)
        _, p, q = part
        return sp.Rational(p, q)


def quotient_of(above: Any, below: Any) -> Any:
    """A sum over another without a common factor, as SymPy would write it.

    SymPy first tests whether any term is infinite, which takes longer than all the rest.
    """
    if below is sp.S.One:
        return above
    top, bottom = _plain_factors(above), _plain_factors(below)
    if top is None or bottom is None or bottom[0] is not sp.S.One:
        return above / below
    powers = [(x.base, -x.exp) if x.is_Pow else (x, sp.S.NegativeOne) for x in bottom[1]]
    inverses = [sp.Pow(base, power, evaluate=False) for base, power in powers]
    return product_in_order(top[0], [*top[1], *inverses])


def _plain_factors(product: Any) -> tuple[Any, list[Any]] | None:
    """The number and the other factors of a product; None where SymPy might merge some of them."""
    factors = list(product.args) if product.is_Mul else [product]
    number = factors.pop(0) if factors[0].is_Rational else sp.S.One
    is_plain = all(
        x.is_Symbol or x.is_Add or (x.is_Pow and x.base.is_Symbol and x.exp.is_Integer)
        for x in factors
    )
    return (number, factors) if is_plain and number else None


def product_in_order(number: Any, factors: Sequence[Any]) -> Any:
    """A number times factors that SymPy would not merge; a sum behind it is not multiplied out."""
    ordered = sorted(factors, key=_IN_ORDER) if len(factors) > 1 else list(factors)
    if number is not sp.S.One:
        ordered.insert(0, number)
    return sp.Mul._from_args(tuple(ordered), True)


def _number(c: Any) -> tuple[str, int, int]:
    """A coefficient as a key: FLINT's own numbers are slow to look up."""
    return _ONE if c == 1 else ("number", int(c.p), int(c.q))
