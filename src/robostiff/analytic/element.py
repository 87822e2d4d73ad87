"""Elements of an exact field, canonical fractions of polynomials, and how these are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, cmp_to_key
from itertools import compress
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.core.cache import cacheit

if TYPE_CHECKING:
    from robostiff.analytic.field import ExactField

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = ("product",)
_ONE = ("number", 1, 1)
_first = itemgetter(0)


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
        if self.field.relations and (self.field.has_roots(num) or self.field.has_roots(den)):
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
    """

    def __init__(self, generators: Sequence[Any]) -> None:
        self._generators = tuple(generators)
        self._merges = [not (g.is_Symbol or isinstance(g, sp.sin | sp.cos)) for g in generators]
        self._some_merge = any(self._merges)
        # The parts of products: generators to a power, and coefficients.
        self._parts: dict[Any, Any] = {_A_PRODUCT: _PRODUCT}
        # Parts in order and their ranks, set at once: a budget may end between two statements.
        self._ranked: tuple[list[Any], dict[Any, int]] = [_PRODUCT], {_A_PRODUCT: 0}

    def expressions(self, polynomials: Sequence[Any]) -> list[Any]:
        """Several of them as canonical sums of products; their factors are ranked together."""
        read = [_rows(polynomial) for polynomial in polynomials]
        needed: set[Any] = {c for numbers, _, _ in read for c in numbers}
        for _, rows, degrees in read:
            for place, degree in enumerate(degrees):
                if degree == 1:
                    needed.add((place, 1))
                elif degree:
                    needed |= {(place, row[place]) for row in rows if row[place]}
        self._write(needed)
        return [self._sum(*own) for own in read]

    def _sum(self, numbers: list[Any], rows: list[tuple[int, ...]], degrees: list[int]) -> Any:
        parts, ranks = self._parts, self._ranked[1]
        if self._some_merge and any(compress(self._merges, degrees)):
            return sp.Add(
                *(
                    sp.Mul(parts[c], *(parts[own] for own in enumerate(row) if own[1]))
                    for c, row in zip(numbers, rows, strict=True)
                )
            )
        once = [ranks.get((place, 1), 0) for place in range(len(degrees))]
        has_powers = max(degrees, default=0) > 1
        written = []
        for c, row in zip(numbers, rows, strict=True):
            if has_powers and max(row) > 1:
                keys = sorted([ranks[own] for own in enumerate(row) if own[1]])
            else:
                keys = sorted(compress(once, row))
            written.append(self._product(c, keys))
        if len(written) == 1:
            return written[0][1]
        written.sort(key=_first)
        whole: Any = sp.Add._from_args(tuple([term for _, term in written]), True)
        return whole

    def _product(self, c: Any, keys: list[int]) -> tuple[tuple[int, ...], Any]:
        """A product of ranked factors, and the key that sorts it."""
        if not keys:
            # A number leads its sum.
            return (-1,), self._parts[c]
        ordered, ranks = self._ranked
        if c != _ONE:
            keys.insert(0, ranks[c])
        if len(keys) == 1:
            return (keys[0],), ordered[keys[0]]
        product = sp.Mul._from_args(tuple([ordered[key] for key in keys]), True)
        return (ranks[_A_PRODUCT], len(keys), *keys), product

    def _write(self, needed: set[Any]) -> None:
        """Write and rank the parts that are needed."""
        parts = self._parts
        known = self._ranked[1]
        missing = [part for part in needed if part not in known]
        if missing:
            parts |= {part: self._written(part) for part in missing}
            ordered = sorted((*known, *missing), key=self._order)
            ranks = {part: rank for rank, part in enumerate(ordered)}
            self._ranked = [parts[part] for part in ordered], ranks

    def _order(self, part: Any) -> Any:
        """Where a part stands among others: as SymPy compares them, or a short cut to the same."""
        if self._symbols is None:
            return _IN_ORDER(self._parts[part])
        if len(part) == 2:
            return (2, part[1] > 1, self._symbols[part[0]], part[1])
        return (3,) if part is _A_PRODUCT else (1, _IN_ORDER(self._parts[part]))

    @cached_property
    def _symbols(self) -> list[Any] | None:
        """What SymPy compares of the generators; None where others than symbols are among them."""
        if any(type(g) is not sp.Symbol for g in self._generators):
            return None
        contents = [g._hashable_content() for g in self._generators]
        return [(len(own), own) for own in contents]

    def _written(self, part: Any) -> Any:
        if len(part) == 2:
            place, power = part
            generator = self._generators[place]
            if power == 1:
                return generator
            return sp.Pow(generator, power, evaluate=not generator.is_Symbol)
        _, p, q = part
        return sp.Rational(p, q)


def quotient_of(above: Any, below: Any) -> Any:
    """A sum over another without a common factor, as SymPy would write it.

    SymPy first tests whether any term is infinite, which takes longer than all the rest.
    """
    inverse = _inverse_of(below)
    return above / below if inverse is None else product_of(above, inverse)


@cacheit
def _inverse_of(below: Any) -> Any:
    bottom = _plain_factors(below)
    if bottom is None:
        return None
    number, factors = bottom
    powers = [(x.base, -x.exp) if x.is_Pow else (x, sp.S.NegativeOne) for x in factors]
    inverse = [x if n is sp.S.One else sp.Pow(x, n, evaluate=False) for x, n in powers]
    return product_of(1 / number, *inverse)


def above_and_below(product: Any) -> tuple[Any, Any]:
    """Numerator and denominator of a product, as SymPy would write them."""
    own = _plain_factors(product)
    if own is None:
        return sp.fraction(product)
    number, factors = own
    below = [x for x in factors if x.is_Pow and x.exp.p < 0]
    above = [x for x in factors if x not in below]
    below = [x.base if x.exp is sp.S.NegativeOne else sp.Pow(x.base, -x.exp) for x in below]
    p, q = sp.Integer(number.p), sp.Integer(number.q)
    return product_of(p, *above), product_of(q, *below)


def product_of(*parts: Any) -> Any:
    """A product as SymPy would write it, at once where nothing merges."""
    number, factors = sp.S.One, []
    for part in parts:
        own = _plain_factors(part)
        if own is None:
            return sp.Mul(*parts)
        number *= own[0]
        factors += own[1]
    bases = {x.base if x.is_Pow else x for x in factors}
    if len(bases) < len(factors) or (len(factors) == 1 and factors[0].is_Add):
        return sp.Mul(*parts)
    return product_in_order(number, factors)


def made_of(expression: Any, parts: Sequence[Any]) -> Any:
    """An expression with other parts, as SymPy would write it."""
    if expression.is_Mul:
        return product_of(*parts)
    if expression.is_Pow and parts[1] is sp.S.Half:
        return root_of(parts[0])
    return expression.func(*parts)


def sum_of(a: Any, b: Any) -> Any:
    """A sum as SymPy would write it, at once where nothing merges."""
    terms = [*sp.Add.make_args(a), *sp.Add.make_args(b)]
    rests = {x.as_coeff_Mul()[1] for x in terms}
    if len(rests) < len(terms) or sp.S.One in rests:
        return a + b
    return sp.Add._from_args(tuple(sorted(terms, key=_IN_ORDER)), True)


def _plain_factors(product: Any) -> tuple[Any, list[Any]] | None:
    """The number and the other factors of a product; None where SymPy might merge some of them."""
    factors = list(product.args) if product.is_Mul else [product]
    number = factors.pop(0) if factors[0].is_Rational else sp.S.One
    is_plain = all(x.is_Symbol or x.is_Add or (x.is_Pow and _is_plain(x)) for x in factors)
    return (number, factors) if is_plain and number else None


def _is_plain(power: Any) -> bool:
    base, exponent = power.args
    if exponent.is_Integer:
        return base.is_Symbol or base.is_Add
    if base.is_Add:
        return exponent.is_Rational and exponent.q == 2 and bool(base.free_symbols)
    return exponent is sp.S.Half and base.is_Mul and all(map(_has_no_sign, base.args))


def product_in_order(number: Any, factors: Sequence[Any]) -> Any:
    """A number times factors that SymPy would not merge; a sum behind it is not multiplied out."""
    ordered = sorted(factors, key=_IN_ORDER) if len(factors) > 1 else list(factors)
    if number is not sp.S.One:
        ordered.insert(0, number)
    return sp.Mul._from_args(tuple(ordered), True)


def root_of(radicand: Any) -> Any:
    """A square root of what is real, as SymPy would write it; it would look for imaginary parts."""
    root = sp.Pow(radicand, sp.S.Half, evaluate=False)
    if radicand.is_Add or (radicand.is_Mul and all(map(_has_no_sign, radicand.args))):
        return root
    return sp.expand_power_base(root, deep=False) if radicand.is_Mul else sp.sqrt(radicand)


def _has_no_sign(factor: Any) -> bool:
    """Whether SymPy knows no sign of a factor, a sum of terms with both; it has none of -1."""
    if not factor.is_Add:
        return factor is sp.S.NegativeOne
    if any(
        x.is_Symbol and x.is_nonnegative is None and x.is_nonpositive is None for x in factor.args
    ):
        return True
    return len({x.could_extract_minus_sign() for x in factor.args if not x.is_Add}) == 2


def _rows(polynomial: Any) -> tuple[list[Any], list[tuple[int, ...]], list[int]]:
    """Coefficients of a polynomial, powers of its generators by terms, and the largest of them."""
    degrees = list(map(int, polynomial.degrees())) if len(polynomial) else []
    return list(map(_number, polynomial.coeffs())), polynomial.monoms(), degrees


def _number(c: Any) -> tuple[str, int, int]:
    """A coefficient as a key: FLINT's own numbers are slow to look up."""
    return _ONE if c == 1 else ("number", int(c.p), int(c.q))
