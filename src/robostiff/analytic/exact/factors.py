"""Polynomials in factors and as sums of squares; matrices of them, and elimination."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import combinations_with_replacement
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.exact.definition import count_of
from robostiff.analytic.exact.element import Element, power_of
from robostiff.analytic.exact.field import ExactField
from robostiff.frozen import frozen

#: A fraction as a number of its ring and irreducible polynomials with their exponents, which are
#: negative below the fraction bar.
Product = tuple[Any, list[tuple[Any, int]]]


def product_of(above: Any, below: Any = None) -> Product:
    """Factor a polynomial that is not zero, or a quotient of two."""
    constant, parts = above.factor()
    powers = [(base, int(exponent)) for base, exponent in parts]
    if below is not None and not below.is_one():
        below_constant, parts = below.factor()
        constant = constant / below_constant
        powers += [(base, -int(exponent)) for base, exponent in parts]
    return constant, powers


def factors_of(field: ExactField, above: Any, below: Any = None) -> Any:
    """A polynomial, or a quotient of two without a common factor, as a product of powers.

    ``R - r`` rather than ``-R + r`` where possible. A number in front of a sum is not multiplied
    out.
    """
    if above.is_zero():
        return sp.Integer(0)
    constant, powers = product_of(above, below)
    written = field.polynomial_expressions([base for base, _ in powers])
    for i, (base, exponent) in enumerate(powers):
        if starts_with_minus(written[i]):  # 1 - 2 x, not -(2 x - 1)
            written[i] = field.polynomial_expression(-base)
            constant *= -1 if exponent % 2 else 1
    product = sp.Mul(*(power_of(x, n) for x, (_, n) in zip(written, powers, strict=True)))
    number = rational(constant)
    return sp.Mul(number, product, evaluate=not (product.is_Add and number != 1))


@cacheit
def starts_with_minus(expression: Any) -> bool:
    """Whether a sum is printed with a minus sign in front."""
    signs = (
        {x.could_extract_minus_sign() for x in expression.args} if expression.is_Add else {False}
    )
    if len(signs) == 1:  # in whatever order
        return signs.pop()
    return expression.as_ordered_terms()[0].could_extract_minus_sign()


def without_sign(expression: Any) -> Any:
    """``R - r`` rather than ``-R + r``, which is zero at the same places."""
    return -expression if starts_with_minus(expression) else expression


def rational(number: Any) -> Any:
    """A number of a polynomial ring in SymPy."""
    return sp.Rational(int(number.p), int(number.q))


def bound_of_terms(expression: Any, most: int) -> int:
    """Bound for the number of terms after multiplying out, at most one more than the limit."""
    if expression.is_Add:
        terms = sum(bound_of_terms(term, most) for term in expression.args)
    elif expression.is_Mul:
        terms = math.prod(bound_of_terms(factor, most) for factor in expression.args)
    elif expression.is_Pow and expression.exp.is_Integer:
        # Powers beyond this one exceed the limit.
        terms = bound_of_terms(expression.base, most) ** min(abs(int(expression.exp)), 40)
    elif isinstance(expression, sp.sin | sp.cos | sp.tan):
        angle: Any = expression.args[0]
        terms = 2 ** min(len(sp.Add.make_args(angle)) - 1, 40)
    else:
        terms = 1
    return min(terms, most + 1)


def completed_squares(field: ExactField, polynomial: Any) -> tuple[list[tuple[Any, Any]], Any]:
    """Complete squares of a quadratic polynomial of plain symbols, each where that is no longer.

    The symbol with the fewest products comes first, as in Lagrange's reduction of quadratic forms:
    R^2 - 2 R r + r^2 + h^2 has (R - r)^2, and h^2 is left.

    Returns
    -------
    list of (polynomial, sympy.Rational), polynomial
        Sums with the number in front of their squares, and the rest.
    """
    if not _is_quadratic(field, polynomial):
        return [], polynomial
    written = field.polynomial_expression
    squares: list[tuple[Any, Any]] = []
    rest, longer = polynomial, set[int]()  # symbols whose square is longer than what it replaces
    while not rest.is_zero():
        counts: dict[int, int] = {}  # of products of symbols with a square
        for place, degree in enumerate(rest.degrees()):
            products = sum(1 for powers, _ in rest.terms() if powers[place] == 1)
            if degree == 2 and products and place not in longer:
                counts[place] = products
        if not counts:
            break
        place = min(counts, key=lambda symbol: counts[symbol])
        slope = rest.derivative(place)
        (twice,) = (c for powers, c in slope.terms() if powers[place])
        constant, ((base, _),) = slope.factor()
        number = constant**2 / (2 * twice)
        remainder = rest - base**2 * number
        square = rational(number) * written(base) ** 2
        if count_of(square + written(remainder)) > count_of(written(rest)):
            longer.add(place)
            continue
        squares.append((base, rational(number)))
        rest = remainder
    return squares, rest


def is_positive_form(field: ExactField, polynomial: Any) -> bool:
    """Whether a polynomial is quadratic in plain symbols and nowhere negative."""
    if not _is_quadratic(field, polynomial):
        return False
    used = [i for i, degree in enumerate(polynomial.degrees()) if degree]
    # The constant is a square of the number 1, which comes last.
    gram: Any = sp.zeros(len(used) + 1)
    for powers, coefficient in polynomial.terms():
        places = [k for k, i in enumerate(used) for _ in range(powers[i])]
        a, b = (places + [len(used)] * 2)[:2]
        gram[a, b] += rational(coefficient / 2)
        gram[b, a] += rational(coefficient / 2)
    return bool(gram.is_positive_semidefinite)


def _is_quadratic(field: ExactField, polynomial: Any) -> bool:
    """Whether a polynomial has degree 2 and no cosines, sines or roots."""
    if polynomial.is_zero() or polynomial.total_degree() != 2:
        return False
    degrees = zip(field.generators, polynomial.degrees(), strict=True)
    return all(generator.is_Symbol for generator, degree in degrees if degree)


def by_powers(polynomial: Any, places: Sequence[int]) -> dict[tuple[int, ...], Any]:
    """What stands before each product of powers of some generators."""
    parts: dict[tuple[int, ...], dict[Any, Any]] = {}
    for powers, number in polynomial.terms():
        others = tuple(0 if i in places else power for i, power in enumerate(powers))
        parts.setdefault(tuple(powers[i] for i in places), {})[others] = number
    return {exponents: polynomial.context().from_dict(terms) for exponents, terms in parts.items()}


@frozen
class ExactMatrix:
    """A symmetric matrix of polynomials over one common denominator."""

    field: ExactField
    entries: tuple[tuple[Any, ...], ...]  # polynomials of the field, upper and lower part
    denominator: Any

    @classmethod
    def of(cls, field: ExactField, entries: Sequence[Any]) -> ExactMatrix:
        """A symmetric matrix, of SymPy expressions row by row, over its common denominator."""
        n = math.isqrt(len(entries))
        elements = {
            (i, j): field.element(entries[i * n + j]) for i in range(n) for j in range(i, n)
        }
        common = common_denominator(field, elements.values())
        upper = {place: over(element, common) for place, element in elements.items()}
        return cls.of_upper(field, n, upper, common)

    @classmethod
    def of_upper(
        cls, field: ExactField, n: int, upper: dict[tuple[int, int], Any], denominator: Any
    ) -> ExactMatrix:
        """From numerators of the upper part by row and column; others are zero."""
        zero = field.ring.constant(0)
        return cls(field, _symmetric(n, upper, zero), denominator)

    def expressions(self) -> sp.ImmutableMatrix:
        """The matrix in SymPy, every entry a canonical fraction."""
        n, field = len(self.entries), self.field
        given = {
            (i, j): field.fraction(self.entries[i][j], self.denominator)
            for i, j in combinations_with_replacement(range(n), 2)
        }
        above = field.polynomial_expressions([x.num for x in given.values()])
        below = field.polynomial_expressions([x.den for x in given.values()])
        written = (a * power_of(b) for a, b in zip(above, below, strict=True))
        rows = _symmetric(n, dict(zip(given, written, strict=True)), sp.S.Zero)
        return sp.ImmutableMatrix(n, n, [entry for row in rows for entry in row])


def common_denominator(field: ExactField, elements: Any) -> Any:
    """Least common denominator of elements."""
    common = field.ring.constant(1)
    for element in elements:
        if not element.has_unit_denominator:
            common = common * element.den / common.gcd(element.den)
    return common


def common_factor(polynomials: Iterable[Any]) -> Any | None:
    """The greatest common divisor of polynomials that are not all zero; None of zeros alone."""
    found: Any = None
    for polynomial in polynomials:
        if not polynomial.is_zero():
            found = polynomial if found is None else found.gcd(polynomial)
            if found.is_constant():
                break
    return found


def shared_factors(field: ExactField, polynomials: Iterable[Any]) -> dict[Any, int]:
    """Irreducible factors with symbols that polynomials share, and their exponents in all.

    Roots and pi are generators of the field, too; a number never vanishes.
    """
    shared = common_factor(polynomials)
    each = [] if shared is None else shared.factor()[1]
    written = {without_sign(field.polynomial_expression(x)): int(power) for x, power in each}
    return {factor: power for factor, power in written.items() if factor.free_symbols}


def over(element: Element, common: Any) -> Any:
    """The numerator of an element over a common denominator."""
    return element.num if common.is_one() else element.num * (common / element.den)


def _symmetric(n: int, upper: dict[tuple[int, int], Any], zero: Any) -> tuple[tuple[Any, ...], ...]:
    rows = [[zero] * n for _ in range(n)]
    for (i, j), entry in upper.items():
        rows[i][j] = rows[j][i] = entry
    return tuple(map(tuple, rows))


def echelon(
    field: ExactField, rows: list[list[Element]]
) -> tuple[list[list[Element]], list[int], Element]:
    """Reduced row echelon form: nonzero rows, pivot columns, and the product of the pivots.

    This is the determinant of a square matrix of full rank.
    """
    rows = [list(row) for row in rows]
    pivots, product = list[int](), field.one
    for column in range(len(rows[0])):
        top = len(pivots)
        found = [i for i in range(top, len(rows)) if not rows[i][column].is_zero]
        if not found:
            continue
        best = min(found, key=lambda i: rows[i][column].terms)
        rows[top], rows[best] = rows[best], rows[top]
        pivot = rows[top][column]
        product = product * pivot if best == top else -product * pivot
        rows[top] = [element / pivot for element in rows[top]]
        for i in range(len(rows)):
            if i != top and not rows[i][column].is_zero:
                factor = rows[i][column]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[top], strict=True)]
        pivots.append(column)
    return rows[: len(pivots)], pivots, product


def null_space(field: ExactField, rows: list[list[Element]], n: int) -> list[list[Element]]:
    """Vectors of n elements that all rows annihilate, each with a 1 where the others have a 0."""
    reduced, pivots, _ = echelon(field, rows) if rows else ([], [], None)
    vectors = []
    for free in (j for j in range(n) if j not in pivots):
        vector = [field.zero] * n
        vector[free] = field.one
        for row, pivot in zip(reduced, pivots, strict=True):
            vector[pivot] = -row[free]
        vectors.append(vector)
    return vectors
