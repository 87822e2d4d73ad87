"""Polynomials written as SymPy expressions, term by term in SymPy's own canonical order."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence
from functools import cmp_to_key
from operator import itemgetter
from typing import Any

import sympy as sp

_IN_ORDER = cmp_to_key(sp.Basic.compare)
# SymPy sorts by class first: any product stands for all of them among numbers, symbols, powers and
# functions.
_PRODUCT = 2 * sp.Symbol("x")
_A_PRODUCT = ("product",)
_ONE = ("number", 1, 1)
_first = itemgetter(0)


class PolynomialWriter:
    """Writes polynomials of some generators as SymPy expressions.

    SymPy sorts and merges the factors of every product and the terms of every sum anew. Of a
    polynomial the factors are known to be distinct, so that ranking each of them once is enough;
    the result is the same expression, arguments in the same order. Roots are left to SymPy, as
    they may merge with each other and with what they are roots of.

    Parameters
    ----------
    generators : sequence of SymPy expressions
        Symbols, sines, cosines and roots.

    Examples
    --------
    >>> import flint
    >>> ring = flint.fmpq_mpoly_ctx.get(["x", "y"], flint.Ordering.lex)
    >>> x, y = ring.gens()
    >>> PolynomialWriter(sp.symbols("x y")).expression(3 * x**2 * y - y / 2 + 1)
    3*x**2*y - y/2 + 1
    """

    def __init__(self, generators: Sequence[Any]) -> None:
        self._generators = tuple(generators)
        self._merges = [not (g.is_Symbol or isinstance(g, sp.sin | sp.cos)) for g in generators]
        # The parts of products: generators to a power, and coefficients.
        self._parts: dict[Any, Any] = {_A_PRODUCT: _PRODUCT}
        self._ordered: list[Any] = [_PRODUCT]
        self._ranks: dict[Any, int] = {_A_PRODUCT: 0}

    def expression(self, polynomial: Any) -> sp.Expr:
        """The polynomial as a canonical sum of products."""
        used = [place for place, degree in enumerate(polynomial.degrees()) if degree]
        terms = [
            (_number(c), [(i, powers[i]) for i in used if powers[i]])
            for powers, c in polynomial.terms()
        ]
        needed = {factor for _, factors in terms for factor in factors}
        parts = self._known_parts(needed.union([c for c, _ in terms]))
        if any(self._merges[place] for place in used):
            return sp.Add(*(sp.Mul(parts[c], *(parts[f] for f in fs)) for c, fs in terms))
        written = [self._product(c, factors) for c, factors in terms]
        if len(written) == 1:
            return written[0][1]
        written.sort(key=_first)
        whole: Any = sp.Add._from_args(tuple(term for _, term in written), True)
        return whole

    def _product(self, c: Any, factors: list[Any]) -> tuple[tuple[int, ...], Any]:
        """A product and the key that sorts it."""
        ranks, parts = self._ranks, self._parts
        if not factors:
            # A number leads its sum.
            return (-1,), parts[c]
        keys = sorted([ranks[factor] for factor in factors])
        if c != _ONE:
            keys.insert(0, ranks[c])
        if len(keys) == 1:
            return (keys[0],), parts[factors[0]]
        ordered = self._ordered
        product = sp.Mul._from_args(tuple([ordered[key] for key in keys]), True)
        return (ranks[_A_PRODUCT], len(keys), *keys), product

    def _known_parts(self, needed: set[Any]) -> dict[Any, Any]:
        """All parts written so far, those needed among them, and ranked."""
        parts = self._parts
        missing = [part for part in needed if part not in self._ranks]
        if missing:
            parts |= {part: self._written(part) for part in missing}
            for part in missing:
                insort(self._ordered, parts[part], key=_IN_ORDER)
            place = {written: rank for rank, written in enumerate(self._ordered)}
            self._ranks = {part: place[parts[part]] for part in (*self._ranks, *missing)}
        return parts

    def _written(self, part: Any) -> Any:
        if len(part) == 2:
            place, power = part
            return self._generators[place] ** power
        _, p, q = part
        return sp.Rational(p, q)


def _number(c: Any) -> tuple[str, int, int]:
    """A coefficient as a key: FLINT's own numbers are slow to look up."""
    return "number", int(c.p), int(c.q)
