"""Zeros of quadratic polynomials of an exact field, as short products."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.factors import factored, rational
from robostiff.analytic.field import ExactField


def quadratic_roots(field: ExactField, polynomial: Any, unknown: sp.Symbol) -> list[sp.Expr]:
    """Zeros of a polynomial of degree 1 or 2 in an unknown, as short products.

    Parameters
    ----------
    field : ExactField
    polynomial : polynomial of the field
    unknown : sympy.Symbol
        One of its generators.

    Returns
    -------
    list of SymPy expressions
        One, or two of which the first has the minus sign.

    Examples
    --------
    >>> x, a, b = sp.symbols("x a b")
    >>> field = ExactField([x, a, b])
    >>> quadratic_roots(field, field.element(x**2 - 2 * a * x + a**2 - 4 * b).num, x)
    [a - 2*sqrt(b), a + 2*sqrt(b)]
    """
    place = field.generators.index(unknown)
    c0, c1, c2 = (_coefficient(polynomial, place, power) for power in range(3))
    if c2.is_zero():
        return [_quotient(field, -c0, c1)]
    outside, inside = _root(field, field.reduced(c1 * c1 - 4 * c2 * c0))
    if inside == 1:
        return [_quotient(field, -c1 + sign * outside, 2 * c2) for sign in (-1, 1)]
    # The common factor of both parts is written in front.
    common = c1.gcd(outside)
    number, root = inside.as_coeff_Mul()
    plain, plain_number = _primitive(field, -(c1 / common))
    other, other_number = _primitive(field, outside / common)
    other_number *= number
    shared = sp.gcd(plain_number, other_number) if plain_number != 0 else other_number
    front = shared * _quotient(field, common, 2 * c2)
    plain, other = plain_number / shared * plain, other_number / shared * other * root
    if front.is_Rational:
        return [sp.expand(front * plain) + sign * front * other for sign in (-1, 1)]
    return [front * (plain + sign * other) for sign in (-1, 1)]


def _primitive(field: ExactField, polynomial: Any) -> tuple[Any, Any]:
    """A polynomial with coprime integer coefficients, and the factor in front."""
    if polynomial.is_zero():
        return sp.Integer(0), sp.Integer(0)
    number, expression = field.polynomial_expression(polynomial).primitive()
    return expression, number


def _coefficient(polynomial: Any, place: int, power: int) -> Any:
    """Coefficient of a power of one generator."""
    kept = {
        (*powers[:place], 0, *powers[place + 1 :]): number
        for powers, number in polynomial.terms()
        if powers[place] == power
    }
    return polynomial.context().from_dict(kept)


def _root(field: ExactField, radicand: Any) -> tuple[Any, Any]:
    """Square root as a polynomial outside and a SymPy expression inside the root sign."""
    one = field.ring.constant(1)
    if radicand.is_zero():
        return radicand, sp.Integer(1)
    constant, powers = radicand.factor()
    outside, inside = one, one
    for base, exponent in powers:
        outside = outside * base ** (int(exponent) // 2)
        inside = inside * base ** (int(exponent) % 2)
    number = rational(constant)
    if number < 0:
        number, inside = -number, -inside
    return outside, sp.sqrt(number) * _root_sign(field, inside)


def _root_sign(field: ExactField, radicand: Any) -> Any:
    """Square root of a polynomial; a sine or root of the field where it is the square of one."""
    for relation in field.relations:
        quotient, rest = divmod(radicand, relation.square)
        if rest.is_zero() and quotient.is_constant():
            number = rational(quotient.leading_coefficient())
            if number > 0:
                return sp.sqrt(number) * field.generators[relation.place]
    return sp.sqrt(factored(field, radicand))


def _quotient(field: ExactField, above: Any, below: Any) -> Any:
    """A fraction as a quotient of products."""
    fraction = field.fraction(above, below)
    return factored(field, fraction.num) / factored(field, fraction.den)
