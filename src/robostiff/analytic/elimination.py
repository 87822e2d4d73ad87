"""Gaussian elimination in an exact field: echelon form, null space, determinant."""

from __future__ import annotations

from robostiff.analytic.field import Element, ExactField


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
