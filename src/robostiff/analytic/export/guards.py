"""Where a program does not hold: denominators of which nothing but rounding is left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

#: Part of the terms of a denominator that must be left: below, the digits of K are lost.
SAFE = 1e-6
#: The same of what stands under a root there.
SAFE_UNDER_ROOT = 1e-12


@dataclass(frozen=True)
class Guard:
    """A sum that must not cancel: |sum of terms| > part * sum of |terms|.

    Attributes
    ----------
    value : sympy.Expr
        The sum, or the symbol to which it is assigned.
    terms : tuple of sympy.Expr
    part : float
    """

    value: Any
    terms: tuple[Any, ...]
    part: float


def guards_of(expressions: Iterable[Any], assigned: Mapping[Any, Any]) -> tuple[Guard, ...]:
    """The sums by which expressions divide, and that can cancel.

    Parameters
    ----------
    expressions : iterable of SymPy expressions
    assigned : mapping of symbols to expressions
        Intermediates, in order.

    Examples
    --------
    >>> x, t = sp.symbols("x t", positive=True)
    >>> [g.value for g in guards_of([1 / t + 1 / (x + 1)], {t: x - 1})]
    [t]
    """
    positive: set[Any] = set()
    for symbol, expression in assigned.items():
        if _is_nonnegative(expression, positive):
            positive.add(symbol)
    found: dict[Any, Guard] = {}
    for expression in (*assigned.values(), *expressions):
        for below in _denominators(expression):
            for guard in _sums(below, below, assigned, positive, SAFE):
                found.setdefault(guard.value, guard)
    return tuple(found.values())


def _denominators(expression: Any) -> Iterator[Any]:
    part: Any
    for part in sp.preorder_traversal(expression):
        if part.is_Pow and part.exp.could_extract_minus_sign():
            yield part.base


def _sums(
    below: Any, value: Any, assigned: Mapping[Any, Any], positive: set[Any], part: float
) -> Iterator[Guard]:
    """The sums among the factors of a denominator, through roots and names."""
    if below in assigned:
        yield from _sums(assigned[below], below, assigned, positive, part)
    elif below.is_Add:
        if not _is_nonnegative(below, positive):
            yield Guard(value, below.args, part)
    elif below.is_Mul:
        for factor in below.args:
            yield from _sums(factor, factor, assigned, positive, part)
    elif below.is_Pow:
        under = SAFE_UNDER_ROOT if not below.exp.is_Integer else part
        yield from _sums(below.base, below.base, assigned, positive, under)


def _is_nonnegative(expression: Any, positive: set[Any]) -> bool:
    """Whether an expression cannot be negative, seen from its form."""
    if expression in positive or expression.is_nonnegative:
        return True
    if expression.is_Add or expression.is_Mul:
        return all(_is_nonnegative(part, positive) for part in expression.args)
    if expression.is_Pow:
        exponent = expression.exp
        is_even = exponent.is_Integer and int(exponent) % 2 == 0
        is_root = exponent.is_Rational and exponent.q % 2 == 0
        return is_even or is_root or _is_nonnegative(expression.base, positive)
    return False
