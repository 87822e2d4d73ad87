"""Where the rank of a derivation in named steps drops, and where it decouples.

K = W diag(1/c) W^T loses rank where the wrenches W do, or where a spring in c has no stiffness.
By Cauchy and Binet all minors of K of its rank are sums of minors of W, of which the common factors
are sought. Lengths and other roots stay names, so that all is a polynomial.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import combinations
from operator import mul
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.exact.definition import used_definitions
from robostiff.analytic.exact.factors import bound_of_terms, without_sign
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.products import FormulaTooLargeError
from robostiff.analytic.robot_derivation import RobotDerivation
from robostiff.spatial import Space

_LONGEST = (2000, 20, 3)  # terms of a step that is written out; fewer where minors are too long
_MOST_MINORS = 2000
_LARGEST = 1000  # terms of a minor that is factored, as FLINT's calls cannot be stopped
_PRODUCTS = 200_000  # of terms, on the way to all minors
_RANK = 1e-8  # of the largest singular value
_SEED = 11


@dataclass(frozen=True)
class WrittenSteps:
    """Steps of a derivation written out, except roots, and what is too long, which keep a name."""

    derivation: Derivation
    longest: int = _LONGEST[0]  # terms of a step that is written out

    @cached_property
    def _full(self) -> dict[Any, Any]:
        full: dict[Any, Any] = {}
        most = self.longest
        for d in self.derivation.definitions:
            expression: Any = d.expression.xreplace(full)
            if not _has_root(expression) and bound_of_terms(expression, most) <= most:
                full[d.symbol] = expression
        return full

    def __call__(self, expression: Any) -> Any:
        """An expression or matrix in given symbols and in names of roots."""
        return expression.xreplace(self._full)


def _has_root(expression: Any) -> bool:
    powers = expression.atoms(sp.Pow)
    return any(not p.exp.is_Integer and p.free_symbols for p in powers)


@dataclass(frozen=True)
class Locus:
    """Where a stiffness loses rank."""

    factors: dict[Any, int]  # irreducible factors with their exponents in the minors of K
    remark: str = ""  # why they were not looked for; empty otherwise


def rank_locus(derivation: RobotDerivation, rank: int) -> Locus:
    """Common factors of all minors of K of its rank, for a derivation in steps.

    `rank`: of K in general.

    Raises
    ------
    FormulaTooLargeError
        When a minor is too long to be factored.
    """
    n = derivation.K.rows
    if rank == 0:
        return Locus({})
    if any(not leg.joints and len(leg.wrenches) == n for leg in derivation.legs):
        return Locus({}, "a leg without passive joints holds it in all directions")
    minors = math.comb(sum(len(leg.wrenches) for leg in derivation.legs), rank)
    minors *= math.comb(n, rank)
    if minors > _MOST_MINORS:
        return Locus({}, f"where it drops is not searched in {minors} minors of its wrenches")
    for longest in _LONGEST[:-1]:
        with suppress(FormulaTooLargeError):
            return _locus(derivation, longest, rank)
    return _locus(derivation, _LONGEST[-1], rank)


def _locus(derivation: RobotDerivation, longest: int, rank: int) -> Locus:
    written, legs = WrittenSteps(derivation, longest), derivation.legs
    W = [written(w) for leg in legs for w in leg.wrenches]
    c = [written(x) for leg in legs for x in leg.compliances]
    if _rank_in_numbers(W) != rank:
        return Locus({}, "where it drops is hidden by the names of its steps")
    field = ExactField([x for w in W for x in w])
    rows, below = zip(*(_without_denominator(field, w) for w in W), strict=True)
    shared: Any = None
    for minor in _minors(field, rows, below, rank):
        if not minor.is_zero():
            if len(minor) > _LARGEST:
                raise FormulaTooLargeError.beyond(_LARGEST)
            shared = minor if shared is None else shared.gcd(minor)
            if shared.is_constant():
                break
    factors: dict[Any, int] = {}
    for base, exponent in [] if shared is None else shared.factor()[1]:
        factor = without_sign(field.polynomial_expression(base))
        if factor.free_symbols:
            factors[factor] = 2 * int(exponent)
    for stiffness, lost in _without_springs(W, c, rank).items():
        factors[stiffness] = factors.get(stiffness, 0) + lost
    names = {d.symbol for d in derivation.definitions}
    in_names = any(factor.free_symbols & names for factor in factors)
    return Locus(factors, "in names of its steps" * in_names)


def _rank_in_numbers(W: Sequence[Any]) -> int:
    """Rank of wrenches at random values of all symbols and names."""
    if not W:
        return 0
    M = sp.Matrix.hstack(*map(sp.Matrix, W))
    symbols = sorted(M.free_symbols, key=str)
    random = np.random.default_rng(_SEED)
    values = random.uniform(0.5, 1.5, len(symbols))
    numbers = np.array(sp.lambdify(symbols, M, "numpy")(*values.astype(complex)), dtype=complex)
    numbers /= np.linalg.norm(numbers, axis=0)
    return int(np.linalg.matrix_rank(numbers, tol=_RANK))


def _without_denominator(field: ExactField, wrench: Any) -> tuple[list[Any], Any]:
    """A wrench times what makes it a polynomial without a common factor, and its denominator."""
    elements = [field.element(x) for x in wrench]
    below = field.ring.constant(1)
    for x in elements:
        below = below * (x.den / below.gcd(x.den))
    entries = [field.reduced(x.num * (below / x.den)) for x in elements]
    common: Any = None
    for x in entries:
        if not x.is_zero():
            common = x if common is None else common.gcd(x)
    return [x if x.is_zero() else x / common for x in entries], below


def _minors(
    field: ExactField, rows: Sequence[Sequence[Any]], below: Sequence[Any], size: int
) -> Iterator[Any]:
    """Numerators of all minors of a size, those of some rows by those of fewer of them.

    Factors of denominators `below` the rows are no zeros: wrenches made conjugate have them.
    """
    products = 0
    for places in combinations(range(len(rows)), size):
        chosen = [rows[i] for i in places]
        denominator = reduce(mul, (below[i] for i in places))
        n = len(chosen[0])
        known: dict[tuple[int, ...], Any] = {(j,): chosen[0][j] for j in range(n)}
        for k, row in enumerate(chosen[1:], start=1):
            larger = {}
            for columns in combinations(range(n), k + 1):
                total = field.ring.constant(0)
                for place, j in enumerate(columns):
                    rest = known[(*columns[:place], *columns[place + 1 :])]
                    if row[j].is_zero() or rest.is_zero():
                        continue
                    products += len(row[j]) * len(rest)
                    if products > _PRODUCTS:
                        raise FormulaTooLargeError.beyond(_LARGEST)
                    product = row[j] * rest
                    total = total - product if (k + place) % 2 else total + product
                larger[columns] = field.reduced(total)
            known = larger
        yield from (x if x.is_zero() else x / x.gcd(denominator) for x in known.values())


def _without_springs(W: Sequence[Any], c: Sequence[Any], rank: int) -> dict[Any, int]:
    """Stiffnesses without which the rank is lower, and by how much."""
    soft: dict[Any, list[int]] = {}
    for i, x in enumerate(c):
        for term in sp.Add.make_args(sp.expand(x)):
            for base in sp.fraction(term)[1].as_powers_dict():
                if base.is_Symbol:
                    soft.setdefault(base, []).append(i)
    found = {}
    for stiffness, places in soft.items():
        if any(w.has(stiffness) for w in W):
            continue  # a length that divides
        lost = rank - _rank_in_numbers([w for i, w in enumerate(W) if i not in places])
        if lost:
            found[stiffness] = lost
    return found


def coupling_of(K: Any) -> list[Any]:
    """Entries of a matrix between translations and rotations."""
    t = Space.of_size(K.rows).translations
    return list(K[:t, t:])


def shared_zeros(entries: Sequence[Any]) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries share; 0 where all of them are zero."""
    field = ExactField(entries)
    shared: Any = None
    for entry in dict.fromkeys(entries):
        if not (element := field.element(entry)).is_zero:
            zeros = field.zeros(element)
            shared = zeros if shared is None else shared.gcd(zeros)
    if shared is None:
        return (sp.Integer(0),)
    factors = [without_sign(field.polynomial_expression(f)) for f, _ in shared.factor()[1]]
    return tuple(sorted(factors, key=sp.default_sort_key))


def decoupling_in_steps(derivation: Derivation) -> tuple[sp.Expr, ...]:
    """Irreducible factors that all entries between translations and rotations share.

    Raises
    ------
    FormulaTooLargeError
        When entries are too long to be written out.
    """
    entries = coupling_of(derivation.K)
    if not any(entries):
        return (sp.Integer(0),)
    full: dict[Any, Any] = {}
    most = _LONGEST[0]
    for d in used_definitions(derivation.definitions, entries):
        full[d.symbol] = d.expression.xreplace(full)
        if bound_of_terms(full[d.symbol], most) > most:
            raise FormulaTooLargeError.beyond(most)
    return shared_zeros([x.xreplace(full) for x in entries])
