"""Polynomials and fractions as products of irreducible factors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.field import Element, ExactField


@dataclass(frozen=True)
class Product:
    """A fraction as ``number * base_1^exponent_1 * ...``.

    Attributes
    ----------
    number : sympy.Rational
        0 for the fraction 0, which has no powers.
    powers : tuple of (polynomial, int)
        Irreducible polynomials of the field; exponents are negative below the fraction bar.
    """

    number: sp.Rational
    powers: tuple[tuple[Any, int], ...]


def product_of(field: ExactField, formula: Any) -> Product:
    """Factor an expression or an element of a field.

    Examples
    --------
    >>> R, r = sp.symbols("R r")
    >>> field = ExactField([R, r])
    >>> product = product_of(field, (2 * R**2 - 2 * r**2) / (3 * R))
    >>> product.number, len(product.powers)
    (2/3, 3)
    """
    element = formula if isinstance(formula, Element) else field.element(formula)
    if element.is_zero:
        return Product(sp.Integer(0), ())
    above, below = element.num.factor(), element.den.factor()
    number: Any = rational(above[0]) / rational(below[0])
    powers = [(base, int(exponent)) for base, exponent in above[1]]
    powers += [(base, -int(exponent)) for base, exponent in below[1]]
    return Product(number, tuple(powers))


def factored(field: ExactField, polynomial: Any) -> Any:
    """A polynomial as a product of powers, ``R - r`` rather than ``-R + r`` where possible.

    Examples
    --------
    >>> R, r = sp.symbols("R r")
    >>> field = ExactField([R, r])
    >>> factored(field, field.element(r**2 - R**2).num)
    -(R - r)*(R + r)
    """
    if polynomial.is_zero():
        return sp.Integer(0)
    constant, powers = polynomial.factor()
    number: Any = rational(constant)
    factors = []
    for base, exponent in powers:
        written: Any = field.polynomial_expression(base)
        if starts_with_minus(written):
            written, number = -written, number * (-1) ** int(exponent)
        factors.append(written ** int(exponent))
    product = sp.Mul(*factors)
    # A number in front of a sum is not multiplied out.
    is_kept = product.is_Add and number != 1
    return sp.Mul(number, product, evaluate=not is_kept)


def starts_with_minus(expression: Any) -> bool:
    """Whether a sum is printed with a minus sign in front."""
    return expression.is_Add and expression.as_ordered_terms()[0].could_extract_minus_sign()


def rational(number: Any) -> Any:
    """A number of a polynomial ring in SymPy."""
    return sp.Rational(int(number.p), int(number.q))


def bound_of_terms(expression: Any, most: int) -> int:
    """Bound for the number of terms after multiplying out, at most one more than the limit.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> bound_of_terms((a + b) ** 3, 500), bound_of_terms((a + b) ** 30, 500)
    (8, 501)
    """
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
