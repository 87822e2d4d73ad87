"""Symmetric matrices in exact arithmetic, and Gaussian elimination.

A matrix has polynomials over one common denominator.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from robostiff.analytic.exact.element import Element, quotient_of
from robostiff.analytic.exact.field import ExactField


@dataclass(frozen=True)
class ExactMatrix:
    """A symmetric matrix of polynomials over one common denominator."""

    field: ExactField
    entries: tuple[tuple[Any, ...], ...]  # polynomials of the field, upper and lower part
    denominator: Any

    @classmethod
    def of(cls, field: ExactField, entries: Sequence[Any]) -> ExactMatrix:
        """A symmetric matrix, of SymPy expressions row by row, over its common denominator."""
        n = math.isqrt(len(entries))
        elements = {
            (i, j): field.element(entries[i * n + j]) for i in range(n) for j in range(i, n)
        }
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
        given = {place: f for place, f in self.fractions.items() if not f.is_zero}
        # Most entries have the same denominator: it is written once.
        dens: list[Any] = []
        places = []
        for fraction in given.values():
            if not dens or fraction.den != dens[-1]:
                dens.append(fraction.den)
            places.append(len(dens) - 1)
        written = self.field.polynomial_expressions([*dens, *(f.num for f in given.values())])
        upper: dict[tuple[int, int], Any] = {
            place: quotient_of(above, written[below])
            for place, above, below in zip(given, written[len(dens) :], places, strict=True)
        }
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
    rows = [[zero] * n for _ in range(n)]
    for (i, j), entry in upper.items():
        rows[i][j] = rows[j][i] = entry
    return tuple(map(tuple, rows))


def echelon(field: ExactField, rows: list[list[Element]]) -> tuple[list[list[Element]], list[int]]:
    """Reduced row echelon form: its nonzero rows and their pivot columns."""
    rows = [list(row) for row in rows]
    pivots: list[int] = []
    for column in range(len(rows[0])):
        top = len(pivots)
        found = [i for i in range(top, len(rows)) if not rows[i][column].is_zero]
        if not found:
            continue
        best = min(found, key=lambda i: rows[i][column].terms)
        rows[top], rows[best] = rows[best], rows[top]
        pivot = rows[top][column]
        rows[top] = [element / pivot for element in rows[top]]
        for i in range(len(rows)):
            if i != top and not rows[i][column].is_zero:
                factor = rows[i][column]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[top], strict=True)]
        pivots.append(column)
    return rows[: len(pivots)], pivots


def null_space(field: ExactField, rows: list[list[Element]], n: int) -> list[list[Element]]:
    """Vectors of n elements that all rows annihilate, each with a 1 where the others have a 0."""
    reduced, pivots = echelon(field, rows) if rows else ([], [])
    vectors = []
    for free in (j for j in range(n) if j not in pivots):
        vector = [field.zero] * n
        vector[free] = field.one
        for row, pivot in zip(reduced, pivots, strict=True):
            vector[pivot] = -row[free]
        vectors.append(vector)
    return vectors


def determinant(field: ExactField, rows: list[list[Element]]) -> Element:
    """Determinant by elimination."""
    rows = [list(row) for row in rows]
    product, sign = field.one, 1
    for column in range(len(rows)):
        found = [i for i in range(column, len(rows)) if not rows[i][column].is_zero]
        if not found:
            return field.zero
        best = min(found, key=lambda i: rows[i][column].terms)
        if best != column:
            rows[column], rows[best] = rows[best], rows[column]
            sign = -sign
        pivot = rows[column][column]
        product = product * pivot
        for i in range(column + 1, len(rows)):
            if not rows[i][column].is_zero:
                factor = rows[i][column] / pivot
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[column], strict=True)]
    return product * sign
