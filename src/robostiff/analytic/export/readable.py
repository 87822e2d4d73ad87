"""Formulas as people write them: common factors in front, products where they are shorter."""

from __future__ import annotations

import math
from typing import Any

import sympy as sp

from robostiff.analytic.export.entries import entries, operations
from robostiff.analytic.field import ExactField
from robostiff.errors import InputError

# Looking for factors is left where it would take seconds.
_MOST_OPERATIONS = 600
_MOST_OPERATIONS_OF_AN_ENTRY = 60
_MOST_TERMS = 500


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
    before = int(expression.count_ops())
    if not 1 < before <= _MOST_OPERATIONS_OF_AN_ENTRY or not _is_manageable([expression]):
        return expression
    try:
        field = ExactField([expression])
        element = field.element(expression)
    except InputError:
        return expression
    factored = _factored(field, element.num) / _factored(field, element.den)
    return factored if int(factored.count_ops()) < before else expression


def readable_matrix(M: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A matrix of readable entries."""
    written = {entry: readable(entry) for entry in entries(M)}
    return sp.ImmutableMatrix(M.rows, M.cols, [written[entry] for entry in entries(M)])


def factored_matrix(K: sp.ImmutableMatrix) -> tuple[sp.Expr, sp.ImmutableMatrix]:
    """Common factor of the entries and what is left; 1 where that would not be shorter.

    Examples
    --------
    >>> k, d = sp.symbols("k d")
    >>> factored_matrix(sp.ImmutableMatrix([[k, k * d], [k * d, k * d**2]]))
    (k, Matrix([
    [1,    d],
    [d, d**2]]))
    """
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
    factor = content * _factored(field, above) / _factored(field, below)
    written = [_factored(field, rest / field.element(content).num) for rest in rests]
    return factor, sp.ImmutableMatrix(K.rows, K.cols, written)


def _factored(field: ExactField, polynomial: Any) -> Any:
    """A polynomial as a product of powers, ``R - r`` rather than ``-R + r`` where it may be."""
    if polynomial.is_zero():
        return sp.Integer(0)
    constant, powers = polynomial.factor()
    number = sp.Rational(int(constant.p), int(constant.q))
    factors = []
    for base, exponent in powers:
        written: Any = field.polynomial_expression(base)
        if written.is_Add and written.as_ordered_terms()[0].could_extract_minus_sign():
            written, number = -written, number * (-1) ** int(exponent)
        factors.append(written ** int(exponent))
    product = sp.Mul(*factors)
    # A number in front of a sum is not multiplied out.
    is_kept = product.is_Add and number != 1
    return sp.Mul(number, product, evaluate=not is_kept)


def _is_manageable(expressions: list[Any]) -> bool:
    """Whether expressions are short when multiplied out, and exact."""
    return all(not e.has(sp.Float) and _most_terms(e) <= _MOST_TERMS for e in expressions)


def _most_terms(expression: Any) -> int:
    """Bound for the number of terms after multiplying out, no larger than needed to compare."""
    if expression.is_Add:
        terms = sum(_most_terms(term) for term in expression.args)
    elif expression.is_Mul:
        terms = math.prod(_most_terms(factor) for factor in expression.args)
    elif expression.is_Pow and expression.exp.is_Integer:
        # Any power beyond this one is too much already.
        terms = _most_terms(expression.base) ** min(abs(int(expression.exp)), 40)
    elif isinstance(expression, sp.sin | sp.cos | sp.tan):
        angle: Any = expression.args[0]
        terms = 2 ** min(len(sp.Add.make_args(angle)) - 1, 40)
    else:
        terms = 1
    return min(terms, _MOST_TERMS + 1)
