"""Exact arithmetic on formulas: fractions of polynomials over symbols, cosines, sines and roots."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

import flint
import sympy as sp
from flint.utils.flint_exceptions import DomainError
from sympy.core.cache import cacheit

from robostiff.analytic.budget import FormulaTooLargeError, spend
from robostiff.analytic.exact.element import (
    Angles,
    Atoms,
    Element,
    OutsideFieldError,
    PolynomialWriter,
    Radicand,
    Roots,
    atoms_of,
    factors_of,
    is_root,
    power_of,
    prepare,
)
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen

# Largest denominator [terms] that is tested for zeros caused by an unknown sign of a root.
_CHECKED = 50
# Most terms above and below of a fraction that is freed of sines: its norm has their square.
_FREED = 2000


@frozen
class Relation:
    """A generator whose square is a polynomial of the generators after it: g^2 = p."""

    place: int
    square: Any
    divisor: Any


class ExactField:
    """The field of fractions of polynomials that contains a set of SymPy expressions.

    Symbols are generators; so are the cosine of each angle, its sine with s^2 = 1 - c^2, and
    square roots with their defining relations. Two elements are equal exactly when they have the
    same canonical form, so that zero is recognised for certain; relations among roots of roots,
    as sqrt(a + sqrt(b)) sqrt(a - sqrt(b)) = sqrt(a^2 - b), are not known.

    Parameters
    ----------
    of : iterable of SymPy expressions, or their Atoms
        Everything that shall be written in the field: sums, products, quotients, integer powers,
        square roots, sines, cosines and tangents. Floats are taken as the decimal number they
        print as.

    Raises
    ------
    InputError
        When an expression is built from another function, or the sign of a root is not known.
    """

    def __init__(self, of: Iterable[Any] | Atoms) -> None:
        atoms = of if isinstance(of, Atoms) else atoms_of(map(prepare, of))
        roots = Roots(atoms.roots, _taken_apart)
        self._angles = Angles.of(atoms.angles)
        angles = self._angles.independent
        # Lexicographic order, relations first: the radicand of a root comes after it.
        self.generators: tuple[sp.Expr, ...] = (
            *roots.squares,
            *(sp.sin(angle) for angle in angles),
            *(sp.cos(angle) for angle in angles),
            *atoms.symbols,
        )
        names = [f"g{i}" for i in range(len(self.generators))]
        self.ring: Any = flint.fmpq_mpoly_ctx.get(names, flint.Ordering.lex)
        self._gens = self.ring.gens()
        self._place = {generator: i for i, generator in enumerate(self.generators)}
        self._known: dict[Any, Element] = {}
        self._roots = roots.values
        self._writer = PolynomialWriter(self.generators)
        self.relations: tuple[Relation, ...] = ()
        for angle in angles:
            sine, cosine = self._place[sp.sin(angle)], self._place[sp.cos(angle)]
            self._relate(sine, 1 - self._gens[cosine] ** 2)
        for root, square in reversed(roots.squares.items()):
            radicand = self.element(square)
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
        above = self.polynomial_expression(element.num)
        if element.has_unit_denominator:
            return above
        return above * power_of(self.polynomial_expression(element.den))

    def polynomial_expression(self, polynomial: Any) -> sp.Expr:
        """Write a polynomial of the generators as a SymPy expression."""
        return self._writer.expressions([polynomial])[0]

    def polynomial_expressions(self, polynomials: Sequence[Any]) -> list[Any]:
        """Write several polynomials."""
        return self._writer.expressions(polynomials)

    def reduce(self, polynomial: Any) -> Any:
        """Bring the squares of sines and roots to their normal form."""
        spend()
        for relation in self.relations:
            if polynomial.degrees()[relation.place] > 1:
                polynomial = divmod(polynomial, relation.divisor)[1]
        return polynomial

    def fraction(self, num: Any, den: Any) -> Element:
        """Fraction without a common factor, its denominator monic.

        A denominator that is a root or sine times something is freed of it, 1 / g = g / g^2, and
        of sines and roots of numbers. Any other sum a + b g stays: its conjugate a - b g may vanish
        where the fraction is regular, as 1 / (1/k + L/(E A)) is at E A = k L, and the fraction
        would be 0 / 0 there.
        """
        if den.is_one():
            return Element(self, self.reduce(num), den)
        num, den = self.reduce(num), self.reduce(den)
        if den.is_zero():
            raise InputError("formula", expected="no division by zero")
        for relation in self.relations:
            if den.degrees()[relation.place]:
                num, den = self._freed(num, den, relation)
        if num.is_zero():
            return self.zero
        if not den.is_constant():
            common = num.gcd(den)
            if not common.is_one():
                num, den = num / common, den / common
        leading = den.leading_coefficient()
        return (
            Element(self, num, den) if leading == 1 else Element(self, num / leading, den / leading)
        )

    def has_roots(self, polynomial: Any) -> bool:
        """Whether a root or sine occurs in a polynomial."""
        degrees = polynomial.degrees()
        return any(degrees[relation.place] for relation in self.relations)

    def zeros(self, element: Element) -> Any:
        """A polynomial with the zeros of an element: its numerator without spurious factors.

        A factor a - b g above a norm a^2 - b^2 g^2 is one over a + b g, and no zero.
        """
        conjugate, below = self._norm(element.den)
        above = self.reduce(element.num * conjugate)
        common = above.gcd(below)
        above, below = above / common, below / common
        for factor, power in above.factor()[1]:
            if not self.has_roots(factor):
                continue
            norm = self._norm(factor)[1]
            for _ in range(int(power)):
                rest = quotient(below, norm)
                if rest is None:
                    break
                above, below = above / factor, rest
        return above

    def _norm(self, polynomial: Any) -> tuple[Any, Any]:
        """The product of all conjugates of a polynomial but itself, and of all of them."""
        others, norm = self.ring.constant(1), polynomial
        for relation in self.relations:
            if norm.degrees()[relation.place]:
                conjugate = norm.compose(*self._conjugation(relation.place))
                others = self.reduce(others * conjugate)
                norm = self.reduce(norm * conjugate)
        return others, norm

    def _freed(self, num: Any, den: Any, relation: Relation) -> tuple[Any, Any]:
        """A fraction over b g as one over b g^2; one over a + b g as it is, which is not zero."""
        root = self._gens[relation.place]
        with_root = (den - den.compose(*self._conjugation(relation.place))) / 2
        plain = den - with_root
        if plain.is_zero():
            return self.reduce(num * root), self.reduce(with_root / root * relation.square)
        is_sine = isinstance(self.generators[relation.place], sp.sin)
        goes_up = is_sine or relation.square.is_constant()
        if len(den) > _CHECKED and not goes_up:
            return num, den
        if max(len(num), len(den)) > _FREED:
            raise FormulaTooLargeError.beyond(_FREED)
        norm = self.reduce(plain**2 - (with_root / root) ** 2 * relation.square)
        if norm.is_zero():
            raise InputError(
                "formula",
                got=Words(f"a division by {self.polynomial_expression(den)}"),
                expected="roots of known signs",
                hint="declare symbols, such as Symbol('a', positive=True)",
            )
        # Sines and roots of numbers cancel only where they are brought up.
        return (self.reduce(num * (plain - with_root)), norm) if goes_up else (num, den)

    def _conjugation(self, place: int) -> list[Any]:
        return [-g if i == place else g for i, g in enumerate(self._gens)]

    def _relate(self, place: int, square: Any) -> None:
        divisor = self._gens[place] ** 2 - square
        # Generators before others in the order are reduced first.
        relations = [*self.relations, Relation(place, square, divisor)]
        self.relations = tuple(sorted(relations, key=lambda relation: relation.place))

    def _read(self, expression: Any) -> Element:
        found = self._known.get(expression)
        if found is not None:
            return found
        spend()
        if (place := self._place.get(expression)) is not None:
            found = Element(self, self._gens[place], self.one.den)
        elif expression.is_Rational:
            number = flint.fmpq(int(expression.p), int(expression.q))
            found = Element(self, self.ring.constant(number), self.one.den)
        elif expression.is_Add:
            terms = list(map(self._read, expression.args))
            whole = sum((x.num for x in terms if x.has_unit_denominator), self.zero.num)
            fractions = (x for x in terms if not x.has_unit_denominator)
            found = sum(fractions, Element(self, whole, self.one.den))
        elif expression.is_Mul:
            num = den = self.one.num
            for factor in map(self._read, expression.args):
                num, den = num * factor.num, den * factor.den
            found = self.fraction(num, den)
        elif expression.is_Pow and expression.exp.is_Integer:
            found = self._read(expression.base) ** int(expression.exp)
        elif is_root(expression):
            root: Any = sp.Pow(expression.base, sp.Rational(1, expression.exp.q))
            read = self._read_root(root) if is_root(root) else self._read(root)
            found = read ** int(expression.exp.p)
        elif (expanded := self._angles.expand(expression)) is not None:
            found = self._read(expanded)
        else:
            raise self._unknown(expression)
        self._known[expression] = found
        return found

    def _read_root(self, root: Any) -> Element:
        value = self._roots.get(root)
        if value is not None:
            coefficient, generators = value
            return math.prod(map(self._read, generators), start=self._read(coefficient))
        # The same root may be written in another way.
        radicand = self._read(root**2)
        for relation in self.relations if radicand.has_unit_denominator else ():
            if self.generators[relation.place].is_Pow and radicand.num == relation.square:
                return Element(self, self._gens[relation.place], self.ring.constant(1))
        raise self._unknown(root)

    def _unknown(self, expression: Any) -> OutsideFieldError:
        return OutsideFieldError(
            "formula",
            got=str(expression),
            expected="a formula of " + ", ".join(str(g) for g in self.generators),
        )


def quotient(a: Any, d: Any) -> Any | None:
    """The exact quotient of two polynomials of one ring; None when d does not divide a."""
    spend()
    try:
        return a / d
    except DomainError:
        return None


_field_of = cacheit(ExactField)


def shared_field(*expressions: Any) -> ExactField:
    """One and the same field for the same symbols, angles and roots: it keeps what it reads."""
    return _field_of(atoms_of(map(prepare, expressions)))


@cacheit
def _taken_apart(root: Any) -> Radicand:
    """Numerator times denominator of a radicand, factored if it contains no roots."""
    field = shared_field(root**2)
    written = field.polynomial_expression
    under = field.element(root**2)
    below = field.polynomial_expression(under.den)
    product = field.reduce(under.num * under.den)
    degrees = product.degrees()
    if any(degrees[relation.place] for relation in field.relations):
        return Radicand(root, root**2 if below == 1 else written(product), below, {})
    return Radicand(root, written(product), below, factors_of(product, written))
