"""Where the rank of a derivation in named steps drops, and where it decouples.

K = W diag(1/c) W^T loses rank where the wrenches W do, or where a spring in c has no stiffness.
By Cauchy and Binet all minors of K of its rank are sums of minors of W, of which the common factors
are sought. Lengths and other roots stay names, so that all is a polynomial.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import combinations
from operator import mul
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from robostiff.analytic.budget import FormulaTooLargeError
from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.exact.definition import Definition, count_of, used_definitions
from robostiff.analytic.exact.factors import (
    bound_of_terms,
    common_denominator,
    common_factor,
    is_positive_form,
    over,
    shared_factors,
    without_sign,
)
from robostiff.analytic.exact.field import ExactField
from robostiff.spatial import Space

_LONGEST = (2000, 20, 3)  # terms of a step that is written out; fewer where minors are too long
_MOST_MINORS = 2000
_LARGEST = 1000  # terms of a minor that is factored, as FLINT's calls cannot be stopped
_PRODUCTS = 200_000  # of terms, on the way to all minors
_RANK = 1e-8  # of the largest singular value
_SEED = 11


def written_steps(derivation: Derivation, longest: int = _LONGEST[0]) -> Callable[[Any], Any]:
    """Writes expressions in given symbols and in names of roots, and of steps that are too long.

    `longest`: terms of a step that is written out.
    """
    full: dict[Any, Any] = {}
    for d in derivation.definitions:
        expression: Any = d.expression.xreplace(full)
        powers = expression.atoms(sp.Pow)
        has_root = any(not p.exp.is_Integer and p.free_symbols for p in powers)
        if not has_root and bound_of_terms(expression, longest) <= longest:
            full[d.symbol] = expression
    return lambda x: x.xreplace(full)


#: Irreducible factors that vanish where a stiffness loses rank, with their exponents in the minors
#: of K, and why they were not looked for; empty otherwise.
Locus = tuple[dict[Any, int], str]


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
        return {}, ""
    if any(not leg.joints and len(leg.wrenches) == n for leg in derivation.legs):
        return {}, "a leg without passive joints holds it in all directions"
    minors = math.comb(sum(len(leg.wrenches) for leg in derivation.legs), rank)
    minors *= math.comb(n, rank)
    if minors > _MOST_MINORS:
        return {}, f"where it drops is not searched in {minors} minors of its wrenches"
    for longest in _LONGEST[:-1]:
        with suppress(FormulaTooLargeError):
            return _locus(derivation, longest, rank)
    return _locus(derivation, _LONGEST[-1], rank)


def _locus(derivation: RobotDerivation, longest: int, rank: int) -> Locus:
    written, legs = written_steps(derivation, longest), derivation.legs
    W = [written(w) for leg in legs for w in leg.wrenches]
    c = [written(x) for leg in legs for x in leg.compliances]
    if _rank_in_numbers(W) != rank:
        return {}, "where it drops is hidden by the names of its steps"
    field = ExactField([x for w in W for x in w])
    rows, below = zip(*(_without_denominator(field, w) for w in W), strict=True)
    shared = shared_factors(field, _minors(field, rows, below, rank))
    factors = {factor: 2 * exponent for factor, exponent in shared.items()}
    for stiffness, lost in _without_springs(W, c, rank).items():
        factors[stiffness] = factors.get(stiffness, 0) + lost
    names = {d.symbol for d in derivation.definitions}
    in_names = any(factor.free_symbols & names for factor in factors)
    return factors, "in names of its steps" * in_names


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
    below = common_denominator(field, elements)
    entries = [field.reduced(over(x, below)) for x in elements]
    common = common_factor(entries)
    return [x if x.is_zero() else x / common for x in entries], below


def _minors(
    field: ExactField, rows: Sequence[Sequence[Any]], below: Sequence[Any], size: int
) -> Iterator[Any]:
    """Numerators of all minors of a size but zeros, those of some rows by those of fewer of them.

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
        for minor in known.values():
            if not minor.is_zero():
                found = minor / minor.gcd(denominator)
                if len(found) > _LARGEST:
                    raise FormulaTooLargeError.beyond(_LARGEST)
                yield found


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
    elements = [x for x in map(field.element, dict.fromkeys(entries)) if not x.is_zero]
    if not elements:
        return (sp.Integer(0),)
    factors = shared_factors(field, map(field.zeros, elements))
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


_DIGITS = 100
_RANK_IN_DIGITS = 1e-20  # of the largest singular value
#: In place of a symbol that becomes zero.
NEARLY_ZERO = sp.Float("1e-40", _DIGITS)
_SEED_OF_VALUES = 3
_LONGEST_CONDITION = 300  # operations of a condition that is factored


@dataclass(frozen=True)
class MatrixInNames:
    """A matrix in names of which compliances c stand for 1/c, so that it has no poles there."""

    matrix: Any  # in given symbols, and in names of lengths, products of beams and stiffnesses 1/c
    definitions: tuple[Definition, ...]  # in the order in which they can be computed

    @classmethod
    def of(cls, K: Any, definitions: Sequence[Definition]) -> MatrixInNames:
        """Turn compliances into stiffnesses, and put in names of sums of given symbols."""
        matrix: Any = sp.Matrix(K)
        kept: list[Definition] = []
        for d in definitions:
            if d.symbol.name.startswith("c_"):
                matrix = matrix.xreplace({d.symbol: 1 / d.symbol})
                kept.append(Definition(d.symbol, 1 / _inverted(d.expression, kept)))
            else:
                kept.append(Definition(d.symbol, _inverted(d.expression, kept)))
        for d in reversed(kept):
            root: Any = d.expression
            plain = d.expression.free_symbols and not d.expression.has(*stiffnesses(kept))
            if plain and d.expression.is_polynomial():
                matrix = matrix.xreplace({d.symbol: d.expression})
            elif plain and root.is_Pow and root.exp is sp.S.Half:
                # The square of a root in place of its even powers
                matrix = matrix.replace(
                    lambda x, d=d: x.is_Pow and x.base == d.symbol and (x.exp / 2).is_Integer,
                    lambda x, d=d: d.expression**x.exp,
                )
        return cls(matrix, tuple(kept))

    def written_out(self, expression: Any) -> Any:
        """An expression with what its names stand for."""
        for d in reversed(self.definitions):
            if expression.has(d.symbol):
                expression = expression.xreplace({d.symbol: d.expression})
        return expression

    @cached_property
    def rank(self) -> int:
        """Rank at random numbers, those of the names computed from them."""
        return self.rank_at()

    def rank_at(self, given: Mapping[Any, Any] | None = None, *, without: Any = None) -> int:
        """The same with some numbers given, and where one of the stiffnesses 1/c is zero."""
        random = np.random.default_rng(_SEED_OF_VALUES)
        parts = [*self.matrix, *(d.expression for d in self.definitions)]
        symbols = set().union(*(x.free_symbols for x in parts))
        symbols -= {d.symbol for d in self.definitions}
        values: dict[Any, Any] = {
            s: sp.Rational(int(random.integers(500, 1500)), 997) for s in sorted(symbols, key=str)
        }
        values |= given or {}
        for d in self.definitions:
            values[d.symbol] = sp.N(d.expression.xreplace(values), _DIGITS)
        values |= {without: 0}
        with mpmath.workdps(_DIGITS):
            numbers = self.matrix.xreplace(values).evalf(_DIGITS)
            rows = [[mpmath.mpmathify(x) for x in numbers.row(i)] for i in range(numbers.rows)]
            sizes = mpmath.svd_c(mpmath.matrix(rows), compute_uv=False)
            return sum(1 for i in range(len(sizes)) if sizes[i] > _RANK_IN_DIGITS * sizes[0])

    @property
    def springs(self) -> list[Any]:
        """Given symbols that only stand below fraction bars in compliances: stiffnesses."""
        found: dict[Any, bool] = {}
        for d in self.definitions:
            if not d.symbol.name.startswith("c_"):
                continue
            for term in sp.Add.make_args(sp.expand(1 / d.expression)):
                above, below = sp.fraction(term)
                for symbol in above.free_symbols:
                    found[symbol] = False
                for symbol in below.free_symbols:
                    found.setdefault(symbol, True)
        names = {d.symbol for d in self.definitions}
        return sorted((x for x, only in found.items() if only and x not in names), key=str)

    @property
    def stiffnesses(self) -> list[Any]:
        """Names that stand for stiffnesses, and occur in the matrix."""
        found = stiffnesses(self.definitions) & self.matrix.free_symbols
        return sorted(found, key=str)

    def with_numbers(self, seed: int) -> Any:
        """The matrix with a random whole number for each stiffness: what is left is geometry."""
        random = np.random.default_rng(seed)
        return self.matrix.xreplace(
            {s: sp.Integer(int(random.integers(2, 1000))) for s in self.stiffnesses}
        )

    def zeros_of(self, factor: Any) -> tuple[Any, ...]:
        """Where a factor in names vanishes: irreducible factors in given symbols, if short."""
        names = {d.symbol: d.expression for d in self.definitions}
        if not factor.free_symbols & names.keys():
            return (factor,)
        if factor.is_Symbol and factor.name.startswith("c_"):
            # 1/c vanishes where one of the springs in c has no stiffness.
            terms = sp.Add.make_args(sp.expand(1 / names[factor]))
            below = [sp.fraction(x)[1] for x in terms if not x.could_extract_minus_sign()]
            return self._unique(z for x in below for z in _irreducible(x))
        expression = self.written_out(factor)
        if count_of(expression) > _LONGEST_CONDITION:
            return (factor,)
        above = sp.fraction(sp.together(expression))[0]
        return self._unique(_irreducible(above**2 if above.is_Pow else above))

    def powers_of_zeros(self, factors: Mapping[Any, int]) -> dict[Any, Any]:
        """Of factors in names with exponents: those of factors in given symbols."""
        powers: dict[Any, Any] = {}
        for factor, exponent in factors.items():
            for own in self.zeros_of(factor) if factor.free_symbols else ():
                powers[own] = powers.get(own, 0) + exponent
        return powers

    def _unique(self, factors: Iterable[Any]) -> tuple[Any, ...]:
        """Factors in given symbols: those in names are looked at in turn."""
        names = {d.symbol for d in self.definitions}
        found: dict[Any, None] = {}
        for factor in factors:
            is_name = bool(factor.free_symbols & names)
            for own in self.zeros_of(factor) if is_name else (factor,):
                found[own] = None
        return tuple(found)


def stiffnesses(definitions: Iterable[Definition]) -> set[Any]:
    """Names that stand for stiffnesses: of springs, or of wrenches."""
    letters = ("c_", "k_", "EA_", "EI_", "GJ_")
    return {d.symbol for d in definitions if d.symbol.name.startswith(letters)}


def _inverted(expression: Any, before: Sequence[Definition]) -> Any:
    """An expression in which compliances stand for stiffnesses."""
    turned = {d.symbol: 1 / d.symbol for d in before if d.symbol.name.startswith("c_")}
    return expression.xreplace(turned)


def _irreducible(expression: Any) -> list[Any]:
    """Irreducible factors of a polynomial in symbols and roots that may vanish."""
    field = ExactField([expression])
    found = []
    for base, _ in field.zeros(field.element(expression)).factor()[1]:
        if is_positive_form(field, base):
            continue
        written: Any = field.polynomial_expression(base)
        if written.is_Pow and written.exp == sp.Rational(1, 2):
            found += _irreducible(written.base)
        elif written.free_symbols:
            found.append(without_sign(written))
    return found
