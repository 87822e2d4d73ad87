"""Elements of an exact field, canonical fractions of polynomials, and how these are written."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cmp_to_key
from operator import itemgetter
from typing import Any, ClassVar

import sympy as sp

from robostiff.frozen import frozen

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = "product"
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

            names = sorted(written, key=lambda factor: _IN_ORDER(written[factor]))
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


def made_of(expression: Any, parts: Sequence[Any]) -> Any:
    """An expression with other parts, as SymPy would write it."""
    if expression.is_Mul:
        return sp.Mul(*parts)
    if expression.is_Pow and parts[1] is sp.S.Half:
        return root_of(parts[0])
    return expression.func(*parts)


def root_of(radicand: Any) -> Any:
    """A square root of what is real, as SymPy would write it; it would look for imaginary parts."""
    if not (radicand.is_Add or radicand.is_Mul):
        return sp.sqrt(radicand)
    return sp.expand_power_base(sp.Pow(radicand, sp.S.Half, evaluate=False), deep=False)
