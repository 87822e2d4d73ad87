"""The sum of w w^T / c over transmitted wrenches in exact arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.element import Element
from robostiff.analytic.exact_leg import exact_leg
from robostiff.analytic.factors import factored
from robostiff.analytic.field import ExactField

# Terms of a fraction that is factored: longer ones would take long, and would not be read.
_FACTORED = 100


@dataclass(frozen=True)
class ClosedSum:
    """K = sum of w w^T / c over the wrenches of all legs, every fraction canonical.

    Attributes
    ----------
    K : sympy.ImmutableMatrix
        (n x n). Fractions over one denominator are added; others stay apart, as their sum would be
        long.
    legs : tuple of sympy.ImmutableMatrix
        The part of each leg.
    wrenches : tuple of tuples of sympy.ImmutableMatrix
        Of each leg (n x 1), as long as their entries look simplest.
    compliances : tuple of tuples of sympy.Expr
        What each of them meets.
    """

    K: sp.ImmutableMatrix
    legs: tuple[sp.ImmutableMatrix, ...]
    wrenches: tuple[tuple[sp.ImmutableMatrix, ...], ...]
    compliances: tuple[tuple[sp.Expr, ...], ...]


def closed_sum(
    legs: Sequence[tuple[Sequence[Sequence[Any]], Sequence[Sequence[Any]]]], n: int, limit: int
) -> ClosedSum:
    """Add up what the wrenches of all legs hold.

    Parameters
    ----------
    legs : sequence of (W, A)
        SymPy expressions: m transmitted wrenches of n entries, and the compliance A = W^T C W
        (m x m) that they meet.
    n : int
        Size of a wrench.
    limit : int
        Most terms that an entry may have on the way.

    Raises
    ------
    FormulaTooLargeError
        When an entry would have more.

    Examples
    --------
    >>> k, a = sp.symbols("k a", positive=True)
    >>> root = sp.sqrt(1 + a**2)
    >>> closed_sum([([[1 / root, a / root, 0]], [[1 / k]])], 3, 100).K[0, 0]
    k/(a**2 + 1)
    """
    # One field for all legs: a length that several of them have is one root.
    field = ExactField([x for W, A in legs for row in (*W, *A) for x in row])
    total: dict[tuple[int, int], list[Element]] = {}
    written, wrenches, compliances = [], [], []
    for W, A in legs:
        leg = exact_leg(
            field,
            [[field.element(x) for x in w] for w in W],
            [[*map(field.element, r)] for r in A],
            n,
            limit,
        )
        for place, entry in leg.K.items():
            total[place] = _added(total.get(place, []), entry)
        written.append(_matrix(field, {place: [entry] for place, entry in leg.K.items()}, n))
        wrenches.append(
            tuple(sp.ImmutableMatrix([_expression(field, x) for x in w]) for w in leg.wrenches)
        )
        compliances.append(
            tuple(sp.Mul(*(_expression(field, c) for c in factors)) for factors in leg.met)
        )
    return ClosedSum(_matrix(field, total, n), tuple(written), tuple(wrenches), tuple(compliances))


def _added(fractions: list[Element], entry: Element) -> list[Element]:
    """Fractions of different denominators, with one more."""
    if entry.is_zero:
        return fractions
    alike = [f for f in fractions if f.den == entry.den]
    others = [f for f in fractions if f.den != entry.den]
    summed = sum(alike, entry)
    return others if summed.is_zero else [*others, summed]


def _matrix(
    field: ExactField, upper: dict[tuple[int, int], list[Element]], n: int
) -> sp.ImmutableMatrix:
    written = {
        place: sp.Add(*(_expression(field, fraction) for fraction in fractions))
        for place, fractions in upper.items()
    }
    return sp.ImmutableMatrix(n, n, lambda i, j: written[min(i, j), max(i, j)])


def _expression(field: ExactField, element: Element) -> sp.Expr:
    """A fraction, its numerator and denominator factored where they are short."""
    if element.terms > _FACTORED:
        return field.expression(element)
    above: Any = factored(field, element.num)
    return above / factored(field, element.den)
