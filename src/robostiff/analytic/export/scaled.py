"""Sums with numbers of very many digits, scaled to the range of doubles.

Exact arithmetic on decimals leaves sums such as (a x + b y) / (c x + d y) whose numbers have
hundreds of digits, though the quotient is of usual size. A sum is divided by a power of ten near
its largest number, and what it stands in is multiplied by it; the powers cancel there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

#: Products of numbers with more digits exceed the range of doubles.
LARGE = sp.Integer(10) ** 50


def has_large_numbers(expressions: Iterable[Any]) -> bool:
    """Whether some number in expressions has a numerator or denominator beyond `LARGE`."""
    return any(
        abs(number.p) > LARGE or number.q > LARGE
        for expression in expressions
        for number in expression.atoms(sp.Rational)
    )


def scaled(expression: Any, scales: Mapping[Any, Any]) -> tuple[Any, Any]:
    """A factor and an expression of usual size, whose product is an expression.

    Symbols are to be multiplied by their `scales`, 1 where there is none.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> factor, rest = scaled((10**60 * x + y) / (10**58 * x + 1), {})
    >>> factor, rest.subs({x: 1, y: 0}).evalf(5)
    (100, 1.0000)
    """
    if isinstance(expression, sp.Rational):
        return expression, sp.S.One
    if expression.is_Symbol:
        return scales.get(expression, sp.S.One), expression
    if expression.is_Mul:
        parts = [scaled(part, scales) for part in expression.args]
        return sp.Mul(*(factor for factor, _ in parts)), _product([rest for _, rest in parts])
    if expression.is_Add:
        return _sum([scaled(term, scales) for term in expression.args])
    if expression.is_Pow and expression.exp.is_Rational:
        return _power(*scaled(expression.base, scales), expression.exp)
    arguments = [product(*scaled(argument, scales)) for argument in expression.args]
    return sp.S.One, expression.func(*arguments) if arguments else expression


def _power(factor: Any, rest: Any, exponent: Any) -> tuple[Any, Any]:
    """A power; of a root only an even power of ten comes out."""
    outside = (
        factor if exponent.is_Integer else _even_power(factor) if exponent.q == 2 else sp.S.One
    )
    return outside**exponent, product(factor / outside, rest) ** exponent


def product(factor: Any, rest: Any) -> Any:
    """A factor times an expression, a sum left whole."""
    if factor == 1:
        return rest
    if rest.is_Add:
        return sp.Mul(factor, rest, evaluate=False)
    return _product([factor, rest])


def _sum(terms: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Terms divided by a power of ten when a factor of theirs is large or small."""
    largest = max(abs(factor) for factor, _ in terms)
    power = _even_power(largest)
    return power, sp.Add(*(product(factor / power, rest) for factor, rest in terms))


def _product(factors: list[Any]) -> Any:
    """A product in which a number is not distributed over a sum."""
    factors = [factor for factor in factors if factor != 1]
    return sp.Mul(*factors, evaluate=not any(factor.is_Add for factor in factors))


def _even_power(number: Any) -> Any:
    """An even power of ten near a number; 1 for a number of usual size."""
    if not number or 1 / LARGE <= abs(number) <= LARGE:
        return sp.S.One
    bits = int(abs(number.p)).bit_length() - int(number.q).bit_length()
    return sp.Integer(10) ** (2 * (3 * bits // 20))  # a bit is 3/10 of a digit
