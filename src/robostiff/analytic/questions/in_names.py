"""Questions about a sum of springs, asked of its names: compliances and lengths stay symbols.

Written out, a compliance of some springs is a long sum, whose zeros are of no interest: the
rank is that of the wrenches, and drops where they do, or where a spring has no stiffness. Names
stand for formulas that may depend on one another, so that an answer in names is only taken where it
is that of the formulas at random numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition
from robostiff.analytic.exact.factors import is_positive_form, without_sign
from robostiff.analytic.exact.field import ExactField
from robostiff.analytic.exact.operation_count import count_of

_DIGITS = 100
_RANK = 1e-20  # of the largest singular value
_NEARLY_ZERO = "1e-40"
_SEED = 3
_LONGEST = 300  # operations of a condition that is factored


@dataclass(frozen=True)
class MatrixInNames:
    """A matrix in names of which compliances c stand for 1/c, so that it has no poles there."""

    matrix: Any  # in given symbols, and in names of lengths, products of beams and stiffnesses 1/c
    definitions: tuple[Definition, ...]  # in the order in which they can be computed

    @classmethod
    def of(cls, K: Any, definitions: Sequence[Definition]) -> MatrixInNames:
        """Turn compliances into stiffnesses, and put in names of sums of given symbols."""
        matrix, kept = sp.Matrix(K), []
        for d in definitions:
            if d.symbol.name.startswith("c_"):
                matrix = matrix.xreplace({d.symbol: 1 / d.symbol})
                kept.append(Definition(d.symbol, 1 / _inverted(d.expression, kept)))
            else:
                kept.append(Definition(d.symbol, _inverted(d.expression, kept)))
        for d in reversed(kept):
            plain = d.expression.free_symbols and not d.expression.has(*stiffnesses(kept))
            if plain and d.expression.is_polynomial():
                matrix = matrix.xreplace({d.symbol: d.expression})
            elif plain and d.expression.is_Pow and d.expression.exp == sp.Rational(1, 2):
                matrix = matrix.applyfunc(lambda x, d=d: _without_square(x, d))
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
        return self.rank_without(None)

    def rank_without(self, stiffness: Any) -> int:
        """Rank where one of the stiffnesses 1/c is zero."""
        return self._rank_at(self._numbers({}) | ({} if stiffness is None else {stiffness: 0}))

    def rank_near_zero(self, symbol: Any) -> int:
        """Rank in the limit of a given symbol that becomes zero."""
        return self._rank_at(self._numbers({symbol: sp.Float(_NEARLY_ZERO, _DIGITS)}))

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

    def _rank_at(self, values: dict[Any, Any]) -> int:
        with mpmath.workdps(_DIGITS):
            numbers = self.matrix.xreplace(values).evalf(_DIGITS)
            rows = [[mpmath.mpmathify(x) for x in numbers.row(i)] for i in range(numbers.rows)]
            sizes = mpmath.svd_c(mpmath.matrix(rows), compute_uv=False)
            return sum(1 for i in range(len(sizes)) if sizes[i] > _RANK * sizes[0])

    def _numbers(self, chosen: dict[Any, Any]) -> dict[Any, Any]:
        random = np.random.default_rng(_SEED)
        parts = [*self.matrix, *(d.expression for d in self.definitions)]
        given = set().union(*(x.free_symbols for x in parts))
        given -= {d.symbol for d in self.definitions}
        values: dict[Any, Any] = {
            s: sp.Rational(int(random.integers(500, 1500)), 997) for s in sorted(given, key=str)
        }
        values |= chosen
        for d in self.definitions:
            values[d.symbol] = sp.N(d.expression.xreplace(values), _DIGITS)
        return values

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
        if count_of(expression) > _LONGEST:
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


def _without_square(expression: Any, root: Definition) -> Any:
    """An expression with the square of a root put in for its even powers."""
    return expression.replace(
        lambda x: x.is_Pow and x.base == root.symbol and x.exp.is_Integer and x.exp % 2 == 0,
        lambda x: root.expression**x.exp,
    )


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
