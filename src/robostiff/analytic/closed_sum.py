"""The sum of w w^T / c over transmitted wrenches in exact arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.element import Element
from robostiff.analytic.factors import factored
from robostiff.analytic.field import ExactField
from robostiff.analytic.products import FormulaTooLargeError

# Pairs of terms that a product may have for each term of the limit, before like terms are added.
_PAIRS_A_TERM = 20

# Terms of a fraction that is factored: longer ones would take long, and would not be read.
_FACTORED = 100

#: Entries (i, j) of a symmetric matrix, i <= j.
Upper = dict[tuple[int, int], Element]


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
    legs: Sequence[tuple[Sequence[Sequence[Any]], Sequence[Any]]], n: int, limit: int
) -> ClosedSum:
    """Add up what the wrenches of all legs hold.

    Parameters
    ----------
    legs : sequence of (wrenches, compliances)
        SymPy expressions; the wrenches of a leg are conjugate to one another.
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
    >>> closed_sum([([[1 / root, a / root, 0]], [1 / k])], 3, 100).K[0, 0]
    k/(a**2 + 1)
    """
    # One field for all legs: a length that several of them have is one root.
    field = ExactField([x for ws, cs in legs for x in (*(e for w in ws for e in w), *cs)])
    total: dict[tuple[int, int], list[Element]] = {}
    written, wrenches, compliances = [], [], []
    for ws, cs in legs:
        scaled = [
            _without_roots(field, [field.element(x) for x in w], field.element(c))
            for w, c in zip(ws, cs, strict=True)
        ]
        own, met = [w for w, _ in scaled], [c for _, c in scaled]
        K = _sum(field, own, met, n, limit)
        for place, entry in K.items():
            total[place] = _added(total.get(place, []), entry)
        written.append(_matrix(field, {place: [entry] for place, entry in K.items()}, n))
        wrenches.append(tuple(sp.ImmutableMatrix([_expression(field, x) for x in w]) for w in own))
        compliances.append(tuple(_expression(field, c) for c in met))
    return ClosedSum(_matrix(field, total, n), tuple(written), tuple(wrenches), tuple(compliances))


def _sum(
    field: ExactField, wrenches: list[list[Element]], met: list[Element], n: int, limit: int
) -> Upper:
    K = {(i, j): field.zero for i in range(n) for j in range(i, n)}
    for w, c in zip(wrenches, met, strict=True):
        scaled = [x if x.is_zero else x / c for x in w]
        for (i, j), so_far in K.items():
            if not (w[i].is_zero or w[j].is_zero):
                K[i, j] = _within(so_far + _product(scaled[i], w[j], limit), limit)
    return K


def _without_roots(
    field: ExactField, w: list[Element], c: Element
) -> tuple[list[Element], Element]:
    """A wrench without the factor that its entries share, such as 1 / L; c is scaled with it."""
    pivot = min((x for x in w if not x.is_zero), key=lambda x: x.terms)
    ratios = [x if x.is_zero else x / pivot for x in w]
    below = field.one.num
    for ratio in ratios:
        below = below * (ratio.den / below.gcd(ratio.den))
    scale = Element(field, below, field.one.den)
    factor = scale / pivot
    return [x if x.is_zero else x * scale for x in ratios], c * factor * factor


def _product(a: Element, b: Element, limit: int) -> Element:
    """A product that is given up before it takes long."""
    pairs = max(len(a.num) * len(b.num), len(a.den) * len(b.den))
    if pairs > _PAIRS_A_TERM * limit:
        raise FormulaTooLargeError.beyond(limit)
    return _within(a * b, limit)


def _within(element: Element, limit: int) -> Element:
    if element.terms > limit:
        raise FormulaTooLargeError.beyond(limit)
    return element


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
