"""Trigonometry in its shortest form: sums of angles, and sines with a phase."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.cache import cacheit
from sympy.simplify.fu import TR8, TR10i

from robostiff.analytic.exact.definition import count_of

# Operations, and terms of a sum, beyond which no shorter form is looked for.
_LONGEST = 60
_TERMS = 60


def shortest_trigonometry(expression: Any, longest: int = _LONGEST) -> Any:
    """An expression or matrix with sines and cosines in their shortest form.

    Products of sines become sines of multiples and of sums, ``a sin x + b cos x`` a sine with a
    phase, and ``cos a cos b - sin a sin b`` becomes ``cos(a + b)``. What would be longer stays, and
    so do sums with more than the `longest` operations.
    """
    if isinstance(expression, sp.MatrixBase):
        entries = [_shortest(x, longest) for x in expression.flat()]
        return sp.ImmutableMatrix(*expression.shape, entries)
    return _shortest(expression, longest)


@cacheit
def _shortest(expression: Any, longest: int) -> Any:
    if not expression.has(sp.sin, sp.cos) or count_of(expression) > longest:
        return expression
    return _first_shortest([expression, sp.factor_terms(_walked(expression))])


def _first_shortest(forms: list[Any]) -> Any:
    """That of the fewest operations; of several, the one that prints shortest."""
    least = min(map(count_of, forms))
    found = [x for x in dict.fromkeys(forms) if count_of(x) == least]
    return found[0] if len(found) == 1 else min(found, key=lambda x: len(str(x)))


@cacheit
def _walked(expression: Any) -> Any:
    """The same with each sum and product in its shortest form, inner ones first."""
    if not expression.has(sp.sin, sp.cos) or isinstance(expression, sp.sin | sp.cos):
        return expression
    forms = [walked := expression.func(*map(_walked, expression.args))]
    bases = (f.as_base_exp()[0] for f in expression.args)
    both = [f.args[0] for f in bases if isinstance(f, sp.sin | sp.cos)]
    # A product of functions of different angles is longer as a sum.
    is_open = expression.is_Add or (
        len(both) > 1 and (len({*both}) < len(both) or any(x.has(sp.Add) for x in expression.args))
    )
    for form in dict.fromkeys([expression, walked]) if is_open else ():
        plain = sp.expand(form)
        if len(plain.args) <= _TERMS:
            # Sums of angles may have names.
            are_plain = all(x.args[0].is_Symbol for x in plain.atoms(sp.sin, sp.cos))
            other = _of_sums(sp.expand(TR8(plain))) if are_plain else plain
            each = dict.fromkeys([_of_sums(plain), other])
            forms += [*each, *map(sp.factor_terms, each)]
    return _first_shortest(forms)


def _of_sums(plain: Any) -> Any:
    """With functions of sums of angles, which take sine and cosine of one and the same angle."""
    angles = ({x.args[0] for x in plain.atoms(kind)} for kind in (sp.sin, sp.cos))
    return plain if next(angles).isdisjoint(next(angles)) else TR10i(plain)
