"""Elements of an exact field, canonical fractions of polynomials, and how these are written."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, cmp_to_key
from itertools import combinations
from operator import itemgetter
from typing import Any, ClassVar

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.frozen import frozen

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = "product"
_FEW = 4
_first = itemgetter(0)


@frozen
class Element:
    """An element of an exact field: a canonical fraction of polynomials.

    Supports ``+ - * /``, integer powers and ``==`` with elements and integers.
    """

    field: Any  # an ExactField, which makes it
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

    __hash__: ClassVar[None]  # type: ignore[assignment]  # as any class with __eq__

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

    Terms are taken from FLINT as text, which it writes in a third of the time in which it hands
    out exponents and coefficients one by one.

    `generators`: symbols, sines, cosines and roots; in the text they are g0, g1, ...
    """

    def __init__(self, generators: Sequence[Any]) -> None:
        self._generators = tuple(generators)
        merging = (not (g.is_Symbol or isinstance(g, sp.sin | sp.cos)) for g in generators)
        self._merging = {f"g{i}" for i, merges in enumerate(merging) if merges}
        # Factors of products by their text, in order, and their ranks.
        self._ranked: tuple[list[Any], dict[str, int]] = [_PRODUCT], {_A_PRODUCT: 0}

    def expressions(self, polynomials: Sequence[Any]) -> list[Any]:
        """Several of them as canonical sums of products; their factors are ranked together."""
        # Factors of the terms as text, ["-2", "g0", "g1^3"].
        each = (str(x).replace(" - ", " + -").replace("-g", "-1*g") for x in polynomials)
        texts = [[term.split("*") for term in text.split(" + ")] for text in each]
        factors = {factor for terms in texts for term in terms for factor in term}
        ordered, ranks = self._ranked
        missing = factors - ranks.keys()
        if missing:
            written = {factor: ordered[rank] for factor, rank in ranks.items()}
            for factor in missing:
                name, _, power = factor.partition("^")
                if name.startswith("g"):
                    generator = self._generators[int(name[1:])]
                    is_plain = generator.is_Symbol
                    written[factor] = (
                        sp.Pow(generator, int(power), evaluate=not is_plain) if power else generator
                    )
                else:
                    written[factor] = sp.Rational(*map(int, name.split("/")))

            def order(factor: str) -> Any:  # as SymPy compares factors
                if self._symbols is None:
                    return _IN_ORDER(written[factor])
                if factor.startswith("g"):
                    name, _, power = factor.partition("^")
                    return (2, bool(power), self._symbols[int(name[1:])], int(power or 1))
                return (3,) if factor == _A_PRODUCT else (1, _IN_ORDER(written[factor]))

            names = sorted(written, key=order)
            self._ranked = [written[x] for x in names], {x: rank for rank, x in enumerate(names)}
        return list(map(self._sum, texts))

    def _sum(self, terms: list[list[str]]) -> Any:
        ordered, ranks = self._ranked
        if self._merging and any(
            x.partition("^")[0] in self._merging for term in terms for x in term
        ):
            return sp.Add(*(sp.Mul(*(ordered[ranks[x]] for x in term)) for term in terms))
        among_terms, make, written = ranks[_A_PRODUCT], sp.Mul._from_args, []
        for term in terms:
            if len(term) == 1:
                rank = ranks[term[0]]
                written.append(((rank,), ordered[rank]))
                continue
            keys = sorted([ranks[factor] for factor in term])
            product = make(tuple([ordered[rank] for rank in keys]), True)
            written.append(((among_terms, len(keys), *keys), product))
        if len(written) == 1:
            return written[0][1]
        written.sort(key=_first)
        whole: Any = sp.Add._from_args(tuple([term for _, term in written]), True)
        return whole

    @cached_property
    def _symbols(self) -> list[Any] | None:
        """What SymPy compares of the generators; None where others than symbols are among them."""
        if any(type(g) is not sp.Symbol for g in self._generators):
            return None
        contents = [g._hashable_content() for g in self._generators]
        return [(len(content), content) for content in contents]


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


def product_of(*parts: Any) -> Any:
    """A product as SymPy would write it, at once where nothing merges."""
    number, factors = sp.S.One, []
    for part in parts:
        plain = _plain_factors(part)
        if plain is None:
            return sp.Mul(*parts)
        number *= plain[0]
        factors += plain[1]
    bases = [x.base if x.is_Pow else x for x in factors]
    # Of a few, comparing is quicker than hashing all their parts.
    if len(bases) > _FEW:
        are_different = len(set(bases)) == len(bases)
    else:
        are_different = not any(a == b for a, b in combinations(bases, 2))
    if not are_different or (len(factors) == 1 and factors[0].is_Add):
        return sp.Mul(*parts)
    return product_in_order(number, factors)


def made_of(expression: Any, parts: Sequence[Any]) -> Any:
    """An expression with other parts, as SymPy would write it."""
    if expression.is_Mul:
        return product_of(*parts)
    if expression.is_Pow and parts[1] is sp.S.Half:
        return root_of(parts[0])
    if expression.is_Pow and parts[1].is_Integer and parts[0].is_Add and parts[0].free_symbols:
        # SymPy would look for terms that are infinite.
        return sp.Pow(*parts, evaluate=parts[1] is sp.S.One)
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
