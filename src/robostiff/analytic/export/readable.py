"""Readable formulas: common factors in front, products where they are shorter."""

from __future__ import annotations

import math
from typing import Any

import sympy as sp

from robostiff.analytic.export.entries import entries, operations
from robostiff.analytic.factors import bound_of_terms, factored
from robostiff.analytic.field import ExactField
from robostiff.errors import InputError

#: Of a decimal in print.
DIGITS = 12

# No search for factors where it would take seconds.
_MOST_OPERATIONS = 600
_MOST_OPERATIONS_OF_AN_ENTRY = 60
_MOST_TERMS = 500


def in_decimals(expression: Any) -> Any:
    """The same expression with numbers of many digits as decimals, as people write them.

    Such are products of a material and a section, or lengths between given points. The exact number
    stays in the formula, and in what is exported to be computed.

    Examples
    --------
    >>> k = sp.Symbol("k")
    >>> in_decimals(sp.Rational(3, 10) * k + sp.sqrt(2) * sp.Rational(10**20 + 1, 3 * 10**20))
    3*k/10 + 0.471404520791
    """
    if not any(_is_long(number) for number in expression.atoms(sp.Rational)):
        return expression
    if expression.is_number:
        return sp.Float(expression.evalf(DIGITS + 3), DIGITS)
    if expression.is_Add or expression.is_Mul:
        numbers = [part for part in expression.args if part.is_number]
        others = [in_decimals(part) for part in expression.args if not part.is_number]
        return expression.func(in_decimals(expression.func(*numbers)), *others)
    return expression.func(*map(in_decimals, expression.args))


def _is_long(number: Any) -> bool:
    return any(len(str(abs(x))) > DIGITS for x in (number.p, number.q))


def readable(expression: Any) -> Any:
    """The same expression, factored where that is shorter.

    Examples
    --------
    >>> R, r = sp.symbols("R r")
    >>> readable(R**2 - 2 * R * r + r**2)
    (R - r)**2
    >>> readable(R**2 + r)
    R**2 + r
    """
    expression = in_decimals(expression)
    before = int(expression.count_ops())
    if not 1 < before <= _MOST_OPERATIONS_OF_AN_ENTRY or not _is_manageable([expression]):
        return expression
    try:
        field = ExactField([expression])
        element = field.element(expression)
    except InputError:
        return expression
    # A sum over compliances stays one where that is no longer than over one denominator.
    found = [
        sp.factor_terms(expression),
        factored(field, element.num) / factored(field, element.den),
    ]
    shorter = min(found, key=lambda e: int(e.count_ops()))
    return shorter if int(shorter.count_ops()) < before else expression


def readable_matrix(M: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A matrix of readable entries."""
    written = {entry: readable(entry) for entry in entries(M)}
    return sp.ImmutableMatrix(M.rows, M.cols, [written[entry] for entry in entries(M)])


def factored_matrix(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """Common factor of the entries and the remaining matrix; 1 where that is not shorter.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> factored_matrix(sp.ImmutableMatrix([[k, k * d], [k * d, k * d**2]]))
    (k, Matrix([
    [1,    d],
    [d, d**2]]))
    """
    K = K.applyfunc(in_decimals)
    whole = readable_matrix(K)
    if operations(K) > _MOST_OPERATIONS or not _is_manageable(entries(K)):
        return sp.Integer(1), whole
    try:
        factor, rest = _common_factor(K)
    except InputError:
        return sp.Integer(1), whole
    if operations(rest) + int(factor.count_ops()) < operations(whole):
        return factor, rest
    return sp.Integer(1), whole


def _common_factor(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """``K = factor * rest``, the entries of the rest polynomials with whole coefficients."""
    field = ExactField(entries(K))
    elements = [field.element(entry) for entry in entries(K)]
    above, below = field.ring.constant(0), field.ring.constant(1)
    for element in elements:
        if not element.is_zero:
            above = element.num.gcd(above)
            below = below * (element.den / below.gcd(element.den))
    if above.is_zero():
        return sp.Integer(1), K
    rests = [element.num / above * (below / element.den) for element in elements]
    coefficients = [c for rest in rests for c in rest.coeffs()]
    content = sp.Rational(
        math.gcd(*(int(c.p) for c in coefficients)), math.lcm(*(int(c.q) for c in coefficients))
    )
    factor = content * factored(field, above) / factored(field, below)
    written = [factored(field, rest / field.element(content).num) for rest in rests]
    return factor, sp.ImmutableMatrix(K.rows, K.cols, written)


def _is_manageable(expressions: list[Any]) -> bool:
    """Whether expressions are short when multiplied out, and exact."""
    return all(
        not e.has(sp.Float) and bound_of_terms(e, _MOST_TERMS) <= _MOST_TERMS for e in expressions
    )
