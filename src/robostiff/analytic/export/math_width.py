"""How wide a formula is when it is typeset, in widths of a letter."""

from __future__ import annotations

from typing import Any

import sympy as sp

from robostiff.analytic.export.products import printed_product
from robostiff.analytic.export.symbol_names import differential_parts, is_greek, name_parts

_SMALL = 0.7


def math_width(expression: sp.Basic) -> float:
    """Estimate the width of a typeset expression, fractions upright, in widths of a letter.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> math_width(x)
    1.0
    >>> math_width(x + y)
    4.0
    >>> math_width((x + y) / (x * y)) < math_width(x + y) + 1
    True
    """
    match expression:
        case sp.Symbol():
            width = name_width(expression.name)
        case sp.Add():
            width = sum(math_width(term) + 2 for term in expression.args) - 2
        case sp.Mul():
            width = _product_width(expression)
        case sp.Pow():
            width = _power_width(expression)
        case sp.Rational() if expression.q != 1:
            width = float(max(len(str(expression.p)), len(str(expression.q))))
        case sp.Function():
            arguments = sum(math_width(argument) + 1 for argument in expression.args)
            width = len(type(expression).__name__) + 1 + arguments
        case _:
            width = float(len(str(expression)))
    return width


def name_width(name: str) -> float:
    """Estimate the width of a typeset name, its subscripts small."""
    differential = differential_parts(name)
    if differential is not None:
        inner, by = differential
        return 1.5 + max(name_width(inner), name_width(by))
    parts = name_parts(name)
    small = sum(_word_width(word) for word in parts.subscripts) + len(parts.subscripts) / 2
    return _word_width(parts.letter) + parts.primes / 2 + _SMALL * small


def _word_width(word: str) -> float:
    return 1.0 if is_greek(word) else float(len(word))


def _product_width(expression: sp.Expr) -> float:
    product = printed_product(expression)
    above = _factors_width(product.above)
    if product.below:
        above = max(above, _factors_width(product.below)) + 0.5
    return above + product.negative


def _factors_width(factors: tuple[sp.Expr, ...]) -> float:
    if len(factors) == 1:
        return math_width(factors[0])
    total = 1.0 if not factors else 0.0
    for factor in factors:
        total += math_width(factor) + 0.2 + (2 if isinstance(factor, sp.Add) else 0)
    return total


def _power_width(power: Any) -> float:
    if power.exp.is_Rational and power.exp.is_negative:
        return _product_width(power)
    base = math_width(power.base) + (2 if power.base.is_Add or power.base.is_Mul else 0)
    if power.exp == sp.Rational(1, 2):
        return base + 1
    return base + _SMALL * math_width(power.exp)
