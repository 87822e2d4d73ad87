"""Quadratic polynomials as lengths: sums of squares, and whether they can be negative."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.factors import rational
from robostiff.analytic.field import ExactField


def completed_squares(field: ExactField, polynomial: Any) -> tuple[list[tuple[Any, Any]], Any]:
    """Complete the squares of a quadratic polynomial of plain symbols, where that is no longer.

    The symbol with the fewest products comes first, as in Lagrange's reduction of quadratic forms:
    R^2 - 2 R r + r^2 + h^2 has (R - r)^2, and h^2 is left.

    Returns
    -------
    list of (polynomial, sympy.Rational), polynomial
        Sums with the number in front of their squares, and the rest.

    Examples
    --------
    >>> R, r, h = sp.symbols("R r h")
    >>> field = ExactField([R, r, h])
    >>> squares, rest = completed_squares(field, field.element((R - r) ** 2 / 2 + h**2).num)
    >>> [(field.polynomial_expression(s), number) for s, number in squares]
    [(R - r, 1/2)]
    >>> field.polynomial_expression(rest)
    h**2
    """
    if not _is_quadratic(field, polynomial):
        return [], polynomial
    squares: list[tuple[Any, Any]] = []
    rest = polynomial
    while (place := _next_symbol(rest)) is not None:
        slope = rest.derivative(place)
        (twice,) = (c for powers, c in slope.terms() if powers[place])
        constant, ((base, _),) = slope.factor()
        number = constant**2 / (2 * twice)
        squares.append((base, rational(number)))
        rest = rest - base**2 * number
    written = [number * field.polynomial_expression(base) ** 2 for base, number in squares]
    after = sp.Add(*written, field.polynomial_expression(rest))
    if int(after.count_ops()) > int(field.polynomial_expression(polynomial).count_ops()):
        return [], polynomial
    return squares, rest


def is_positive_form(field: ExactField, polynomial: Any) -> bool:
    """Whether a polynomial is quadratic in plain symbols and nowhere negative.

    Examples
    --------
    >>> R, r = sp.symbols("R r")
    >>> field = ExactField([R, r])
    >>> [is_positive_form(field, field.element(p).num) for p in (R**2 - R * r + r**2, R * r)]
    [True, False]
    """
    if not _is_quadratic(field, polynomial):
        return False
    used = [i for i, degree in enumerate(polynomial.degrees()) if degree]
    # The constant is a square of the number 1, which comes last.
    gram = sp.zeros(len(used) + 1)
    for powers, coefficient in polynomial.terms():
        places = [k for k, i in enumerate(used) for _ in range(powers[i])]
        a, b = (places + [len(used)] * 2)[:2]
        gram[a, b] += rational(coefficient) / 2
        gram[b, a] += rational(coefficient) / 2
    return bool(gram.is_positive_semidefinite)


def _is_quadratic(field: ExactField, polynomial: Any) -> bool:
    """Whether a polynomial has degree 2 and no cosines, sines or roots."""
    if polynomial.is_zero() or polynomial.total_degree() != 2:
        return False
    degrees = zip(field.generators, polynomial.degrees(), strict=True)
    return all(generator.is_Symbol for generator, degree in degrees if degree)


def _next_symbol(polynomial: Any) -> int | None:
    """The symbol with a square and the fewest products, at least one."""
    if polynomial.is_zero():
        return None
    counts: dict[int, int] = {}
    for place, degree in enumerate(polynomial.degrees()):
        products = sum(1 for powers, _ in polynomial.terms() if powers[place] == 1)
        if degree == 2 and products:
            counts[place] = products
    return min(counts, key=lambda place: counts[place], default=None)
