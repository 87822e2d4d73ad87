"""Symmetric matrices in exact arithmetic: polynomials over one common denominator."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from robostiff.analytic.field import Element, ExactField


@dataclass(frozen=True)
class ExactMatrix:
    """A symmetric matrix of polynomials over one common denominator.

    Attributes
    ----------
    field : ExactField
    entries : tuple of tuples
        Polynomials of the field, upper and lower part.
    denominator : polynomial
    """

    field: ExactField
    entries: tuple[tuple[Any, ...], ...]
    denominator: Any

    @classmethod
    def of(cls, field: ExactField, K: Any) -> ExactMatrix:
        """A symmetric SymPy matrix over its common denominator."""
        n = K.rows
        elements = {(i, j): field.element(K[i, j]) for i in range(n) for j in range(i, n)}
        common = common_denominator(field, elements.values())
        upper = {place: over(element, common) for place, element in elements.items()}
        return cls.of_upper(field, n, upper, common)

    @classmethod
    def of_upper(
        cls, field: ExactField, n: int, upper: dict[tuple[int, int], Any], denominator: Any
    ) -> ExactMatrix:
        """From numerators of the upper part by row and column; others are zero."""
        zero = field.ring.constant(0)
        return cls(field, _symmetric(n, upper, zero), denominator)

    @property
    def terms(self) -> int:
        """Number of terms of all numerators."""
        return sum(len(entry) for row in self.entries for entry in row)

    @cached_property
    def fractions(self) -> dict[tuple[int, int], Element]:
        """The canonical fractions of the upper part, by row and column."""
        n = len(self.entries)
        return {
            (i, j): self.field.fraction(self.entries[i][j], self.denominator)
            for i in range(n)
            for j in range(i, n)
        }

    def expressions(self) -> sp.ImmutableMatrix:
        """The matrix in SymPy, every entry a canonical fraction."""
        n = len(self.entries)
        written = self.field.polynomial_expression
        upper: dict[tuple[int, int], Any] = {}
        den, below = self.field.one.den, sp.S.One
        for place, fraction in self.fractions.items():
            # Most entries have the same denominator: it is written once.
            if fraction.den != den:
                den, below = fraction.den, written(fraction.den)
            upper[place] = written(fraction.num) / below
        rows = _symmetric(n, upper, sp.S.Zero)
        return sp.ImmutableMatrix(n, n, [entry for row in rows for entry in row])


def common_denominator(field: ExactField, elements: Any) -> Any:
    """Least common denominator of elements."""
    common = field.ring.constant(1)
    for element in elements:
        if not element.has_unit_denominator:
            common = common * element.den / common.gcd(element.den)
    return common


def over(element: Element, common: Any) -> Any:
    """The numerator of an element over a common denominator."""
    return element.num if common.is_one() else element.num * (common / element.den)


def _symmetric(n: int, upper: dict[tuple[int, int], Any], zero: Any) -> tuple[tuple[Any, ...], ...]:
    return tuple(tuple(upper.get((min(i, j), max(i, j)), zero) for j in range(n)) for i in range(n))
