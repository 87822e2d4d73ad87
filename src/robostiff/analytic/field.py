"""Exact arithmetic on formulas: fractions of polynomials over symbols, cosines, sines and roots."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import flint
import sympy as sp

from robostiff.errors import InputError


@dataclass(frozen=True)
class Relation:
    """A generator whose square is a polynomial of the generators after it: g^2 = p."""

    place: int
    square: Any
    divisor: Any


class ExactField:
    """The fractions of polynomials in which a set of SymPy expressions live.

    Symbols are generators; so are the cosine of each angle, its sine with s^2 = 1 - c^2, and each
    square root with its defining relation. Two elements are equal exactly when they have the same
    canonical form, so that zero is recognised for certain.

    Parameters
    ----------
    expressions : iterable of SymPy expressions
        Everything that shall be written in the field: sums, products, quotients, integer powers,
        square roots, sines, cosines and tangents. Floats are taken as the decimal number they
        print as.

    Raises
    ------
    InputError
        When an expression is built from another function.

    Examples
    --------
    >>> a = sp.Symbol("a")
    >>> field = ExactField([sp.sin(a), sp.cos(a)])
    >>> field.element(sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1).is_zero
    True
    """

    def __init__(self, expressions: Iterable[Any]) -> None:
        prepared = [prepare(expression) for expression in expressions]
        roots, angles, symbols = _atoms(prepared)
        # Lexicographic order, relations first: what a root stands for comes after it.
        self.generators: tuple[sp.Expr, ...] = (
            *roots,
            *(sp.sin(angle) for angle in angles),
            *(sp.cos(angle) for angle in angles),
            *symbols,
        )
        names = [f"g{i}" for i in range(len(self.generators))]
        self.ring = flint.fmpq_mpoly_ctx.get(names, flint.Ordering.lex)
        self._gens = self.ring.gens()
        self._place = {generator: i for i, generator in enumerate(self.generators)}
        self.relations: tuple[Relation, ...] = ()
        for angle in angles:
            sine, cosine = self._place[sp.sin(angle)], self._place[sp.cos(angle)]
            square = 1 - self._gens[cosine] ** 2
            self._relate(sine, square)
        for root in reversed(roots):
            radicand = self.element(root.base)
            if not radicand.has_unit_denominator:
                raise InputError("square root", got=str(root), expected="a root of a polynomial")
            self._relate(self._place[root], radicand.num)

    @cached_property
    def zero(self) -> Element:
        """The element 0."""
        return Element(self, self.ring.constant(0), self.ring.constant(1))

    @cached_property
    def one(self) -> Element:
        """The element 1."""
        return Element(self, self.ring.constant(1), self.ring.constant(1))

    def element(self, expression: Any) -> Element:
        """Write a SymPy expression in the field.

        Raises
        ------
        InputError
            When it contains something that the field was not made for, or divides by zero.
        """
        return self._read(prepare(expression))

    def expression(self, element: Element) -> sp.Expr:
        """Write an element as a SymPy expression."""
        return self.polynomial_expression(element.num) / self.polynomial_expression(element.den)

    def polynomial_expression(self, polynomial: Any) -> sp.Expr:
        """Write a polynomial of the generators as a SymPy expression."""
        terms = []
        for powers, coefficient in polynomial.terms():
            factors = [
                generator**power
                for generator, power in zip(self.generators, powers, strict=True)
                if power
            ]
            number = sp.Rational(int(coefficient.p), int(coefficient.q))
            terms.append(sp.Mul(number, *factors))
        return sp.Add(*terms)

    def reduced(self, polynomial: Any) -> Any:
        """Bring the squares of sines and roots to their normal form."""
        for relation in self.relations:
            if polynomial.degrees()[relation.place] > 1:
                polynomial = divmod(polynomial, relation.divisor)[1]
        return polynomial

    def fraction(self, num: Any, den: Any) -> Element:
        """Canonical fraction: no root below, no common factor, monic denominator."""
        num, den = self.reduced(num), self.reduced(den)
        if den.is_zero():
            raise InputError("formula", expected="no division by zero")
        for relation in self.relations:
            if den.degrees()[relation.place]:
                num, den = self._rationalised(num, den, relation)
        if num.is_zero():
            return self.zero
        common = num.gcd(den)
        if not common.is_one():
            num, den = num / common, den / common
        leading = den.leading_coefficient()
        return Element(self, num / leading, den / leading)

    def _rationalised(self, num: Any, den: Any, relation: Relation) -> tuple[Any, Any]:
        """Multiply by the conjugate a - b g of the denominator a + b g."""
        root = self._gens[relation.place]
        with_root = (den - den.compose(*self._conjugation(relation.place))) / 2
        plain = den - with_root
        conjugate = plain - with_root
        below = plain**2 - (with_root / root) ** 2 * relation.square
        return self.reduced(num * conjugate), self.reduced(below)

    def _conjugation(self, place: int) -> list[Any]:
        return [-g if i == place else g for i, g in enumerate(self._gens)]

    def _relate(self, place: int, square: Any) -> None:
        divisor = self._gens[place] ** 2 - square
        # Generators before others in the order are reduced first.
        relations = [*self.relations, Relation(place, square, divisor)]
        self.relations = tuple(sorted(relations, key=lambda relation: relation.place))

    def _read(self, expression: Any) -> Element:
        if expression in self._place:
            generator = self._gens[self._place[expression]]
            return Element(self, generator, self.ring.constant(1))
        if expression.is_Rational:
            number = flint.fmpq(int(expression.p), int(expression.q))
            return Element(self, self.ring.constant(number), self.ring.constant(1))
        if expression.is_Add:
            total = self.zero
            for term in expression.args:
                total = total + self._read(term)
            return total
        if expression.is_Mul:
            product = self.one
            for factor in expression.args:
                product = product * self._read(factor)
            return product
        if expression.is_Pow:
            base, exponent = expression.args
            if exponent.is_Integer:
                return self._read(base) ** int(exponent)
            if _is_half(exponent):
                return self._read(sp.sqrt(base)) ** int(exponent.p)
        raise InputError(
            "formula",
            got=str(expression),
            expected="a formula of " + ", ".join(str(g) for g in self.generators),
        )


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
        result = self.field.one
        for _ in range(abs(power)):
            result = result * base
        return result

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


def prepare(expression: Any) -> Any:
    """A SymPy expression in the functions that a field knows; floats as exact decimals."""
    prepared = sp.nsimplify(sp.sympify(expression), rational=True)
    prepared = prepared.rewrite(sp.tan, sp.cos) if prepared.has(sp.tan) else prepared
    if prepared.has(sp.sin, sp.cos):
        prepared = sp.expand_trig(prepared)
    return prepared


def _atoms(
    expressions: list[Any],
) -> tuple[list[Any], list[Any], list[Any]]:
    """Roots (outer before inner), angles and symbols of some expressions."""
    roots: set[Any] = set()
    angles: set[Any] = set()
    symbols: set[Any] = set()
    for expression in expressions:
        atom: Any
        for atom in sp.preorder_traversal(expression):
            if isinstance(atom, sp.sin | sp.cos):
                angles.add(atom.args[0])
            elif isinstance(atom, sp.Pow) and _is_half(atom.args[1]):
                roots.add(sp.sqrt(atom.args[0]))
        symbols |= expression.free_symbols
    plain = {
        symbol
        for symbol in symbols
        if any(_occurs_plain(expression, symbol) for expression in expressions)
    }
    ordered = sorted(roots, key=lambda root: (-root.count_ops(), str(root)))
    return ordered, sorted(angles, key=str), sorted(plain, key=str)


def _is_half(exponent: Any) -> bool:
    return bool(exponent.is_Rational) and exponent.q == 2


def _occurs_plain(expression: Any, symbol: Any) -> bool:
    """Whether a symbol occurs outside the angles of sines and cosines."""
    if expression == symbol:
        return True
    if isinstance(expression, sp.sin | sp.cos):
        return False
    return any(_occurs_plain(argument, symbol) for argument in expression.args)
