"""How long a formula is: its operations, counted once for each part of it.

Results are kept in SymPy's own cache, and forgotten with it.
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.cache import cacheit


@cacheit
def count_of(expression: Any) -> int:
    """Operations of an expression, as `sympy.count_ops` counts them.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> formula = -((x - y) ** 2) / 3 + sp.sin(x) * y / x - 1
    >>> count_of(formula), formula.count_ops()
    (8, 8)
    """
    if expression.is_Rational:
        return (expression.p < 0) + (expression.q != 1)
    if expression.is_Mul:
        return _of_product(expression)
    parts = expression.args
    if expression.is_Add:
        minus = [_has_minus(x) for x in parts]
        own = sum(count_of(-x if m else x) for x, m in zip(parts, minus, strict=True))
        return own + len(parts) - 1 + all(minus)
    is_counted = bool(parts) and (expression.is_Pow or expression.is_Function)
    if expression.is_Pow and expression.exp is sp.S.NegativeOne:
        parts = (expression.base,)
    return is_counted + sum(map(count_of, parts))


def _of_product(product: Any) -> int:
    negative = _has_minus(product)
    plain = -product if negative else product
    if not plain.is_Mul:
        return 1 + count_of(plain)
    above, below = sp.fraction(plain)
    if below is sp.S.One:
        return negative + len(plain.args) - 1 + sum(map(count_of, plain.args))
    return negative + 1 + sum(count_of(x) for x in (above, below) if not x.is_Integer)


def _has_minus(term: Any) -> bool:
    number = term.args[0] if term.is_Mul else term
    return bool(number.is_Number and number.is_negative)


@cacheit
def symbols_in(expression: Any) -> frozenset[Any]:
    """The symbols of an expression."""
    return frozenset(expression.free_symbols)


def operations_in(expression: Any) -> int:
    """Operations of a formula; none of a number."""
    return count_of(expression) if symbols_in(expression) else 0
