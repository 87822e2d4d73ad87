"""Ways to write one expression shorter: a name for what recurs in it, or less of names."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy as sp
from sympy.core.cache import cacheit

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.element import made_of, root_of
from robostiff.analytic.exact.operation_count import count_of, operations_in, parts_of, symbols_in

_LONGEST_SUM = 60  # operations of a sum in which two symbols may stand as their difference


@dataclass(frozen=True)
class PartsOfFormula:
    """What a formula consists of."""

    parts: tuple[Any, ...]
    operations: int
    symbols: frozenset[Any]
    below: frozenset[Any]  # symbols below its fraction bars
    rooted: frozenset[Any]  # what stands below its roots
    powers: frozenset[Any]  # bases of its powers
    sums: tuple[Any, ...]
    products: tuple[Any, ...]


@lru_cache(maxsize=2**14)
def facts_of(formula: Any) -> PartsOfFormula:
    """Those of a formula, kept."""
    parts = {formula: None}  # in the order of the formula, the same in every run
    pending = [formula]
    while pending:
        new = [x for x in pending.pop().args if x not in parts]
        parts |= dict.fromkeys(new)
        pending += new
    powers = [x for x in parts if x.is_Pow]
    below = (x.base for x in powers if x.exp.is_Rational and x.exp.is_negative)
    return PartsOfFormula(
        tuple(parts),
        operations_in(formula),
        symbols_in(formula),
        frozenset[Any]().union(*map(symbols_in, below)),
        frozenset(x.base for x in powers if abs(x.exp) is sp.S.Half),
        frozenset(x.base for x in powers),
        tuple(x for x in parts if x.is_Add),
        tuple(x for x in parts if x.is_Mul),
    )


@cacheit
def multiple_of(total: Any, compliance: Any) -> Any:
    """The factor by which a sum is a compliance times moduli and lengths; None of others."""
    above, below = sp.fraction(sp.together(compliance))
    ratio = sp.factor_terms(total).as_coeff_Mul()[0] / sp.factor_terms(above).as_coeff_Mul()[0]
    return ratio * below if sp.expand(total - ratio * above) == 0 else None


@cacheit
def over_a_name(expression: Any, total: Any, name: Any, factor: Any) -> Any:
    """An expression with a name times a factor for a sum below its fraction bars."""
    if total not in parts_of(expression):
        return expression
    parts = [over_a_name(x, total, name, factor) for x in expression.args]
    if not (expression.is_Mul and 1 / total in parts):
        return made_of(expression, parts) if parts else expression
    parts.remove(1 / total)
    sums = [x for x in parts if x.is_Add]
    rest = [x for x in parts if not x.is_Add]
    inside, outside = (sums[0], sums[1:]) if sums else (sp.S.One, [])
    return sp.Mul(*rest, *outside, sp.factor_terms(sp.expand(inside / factor))) / name


@cacheit
def third_side(radicand: Any, above: Any) -> Any:
    """The product b for which b^2 is a radicand and a square a^2; None where b is no product."""
    square = sp.expand(radicand + above**2)
    side = None if square.is_Add else root_of(square).replace(sp.Abs, lambda size: size)
    return None if side is None or side.has(sp.Add) or side.atoms(sp.Pow) else side


@cacheit
def divided(expression: Any, ratio: Definition) -> Any:
    """An expression with powers of a ratio in its products, where these become no longer."""
    if not expression.args or not symbols_in(ratio.expression) <= symbols_in(expression):
        return expression
    expression = made_of(expression, [divided(part, ratio) for part in expression.args])
    if not isinstance(expression, sp.Mul):
        return expression
    left, part = powers(expression), powers(ratio.expression)
    fits = [left.get(base, 0) / power for base, power in part.items()]
    are_whole = all(isinstance(x, Fraction) and x.denominator == 1 for x in fits)
    if not are_whole or min(fits) * max(fits) <= 0:
        return expression
    times = min(fits, key=abs)
    for base, power in part.items():
        left[base] -= times * power
    left[ratio.symbol] = times
    # The number stays in front: 1/4 in a sum of roots would be longer.
    other = sp.Mul(expression.as_coeff_Mul()[0], *(base**power for base, power in left.items()))
    return min(expression, other, key=operations_in)


@cacheit
def _powers_of(product: Any) -> tuple[tuple[Any, Any], ...]:
    powers = product.as_coeff_Mul()[1].as_powers_dict()
    # Numbers of Python: SymPy's take ten times as long.
    return tuple(
        (b, Fraction(int(x.p), int(x.q)) if x.is_Rational else x) for b, x in powers.items()
    )


def powers(product: Any) -> dict[Any, Any]:
    """Powers of the factors of a product."""
    return dict(_powers_of(product))


@cacheit
def by_difference(expression: Any, difference: Definition, a: Any, b: Any) -> Any:
    """An expression with the difference in its sums, where that leaves less of them."""
    if not expression.args or not {a, b} <= symbols_in(expression):
        return expression
    parts = tuple(by_difference(part, difference, a, b) for part in expression.args)
    if parts != expression.args:
        expression = made_of(expression, parts)
    if not (expression.is_Add and {a, b} <= symbols_in(expression)):
        return expression
    if count_of(expression) > _LONGEST_SUM:
        return expression
    first = difference.symbol + b
    other = expression.xreplace({a: first})
    inside = {x for x in parts_of(other) - {other} if x.is_Add}
    if inside and inside <= {first}:
        other = sp.expand(other)
    return other if count_of(other) < count_of(expression) else expression


@cacheit
def with_multiple(expression: Any, length: Any, multiple: Any) -> Any:
    """An expression with a multiple for a length, which comes out of the sums inside."""
    found = expression.xreplace({length: multiple})
    sums = (x for x in facts_of(expression).sums if x is not expression)
    return sp.factor_terms(found) if any(length in symbols_in(x) for x in sums) else found


@cacheit
def with_sum(expression: Any, terms: frozenset[Any], name: Any) -> Any:
    """An expression with a name for some terms of its sums."""
    parts = tuple(with_sum(part, terms, name) for part in expression.args)
    if parts != expression.args:
        expression = made_of(expression, parts)
    if expression.is_Add and terms <= {*expression.args}:
        return name + sp.Add(*(x for x in expression.args if x not in terms))
    return expression


@cacheit
def written_out(formula: Any, symbol: Any, expression: Any) -> Any:
    """A formula with what a name stands for."""
    if symbol not in symbols_in(formula):
        return formula
    if formula == symbol:
        return expression
    if formula.is_Pow and formula.base == symbol and expression.is_Pow:
        power = formula.exp * expression.exp
        if power.is_Integer:
            return expression.base**power
    return made_of(formula, [written_out(x, symbol, expression) for x in formula.args])


@cacheit
def in_squares(expression: Any, symbol: Any, square: Any, once: Any) -> Any:
    """An expression with a name for the square of a symbol, and what stands for an odd factor."""
    powers: dict[Any, Any] = {symbol: once}
    for power in parts_of(expression):
        if power.is_Pow and power.base == symbol and power.exp.is_Integer:
            half, odd = divmod(int(power.exp), 2)
            powers[power] = square**half * once**odd
    return expression.xreplace(powers)
