"""Entries and symbols of matrices, as the expressions that they are."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def entries(matrix: Any) -> list[Any]:
    """All entries of a matrix, row after row.

    Examples
    --------
    >>> import sympy as sp
    >>> entries(sp.Matrix([[1, 2], [3, 4]]))
    [1, 2, 3, 4]
    """
    return [matrix[i, j] for i in range(matrix.rows) for j in range(matrix.cols)]


def rows(matrix: Any) -> list[list[Any]]:
    """The entries of a matrix, a list for each row.

    Examples
    --------
    >>> import sympy as sp
    >>> rows(sp.Matrix([[1, 2], [3, 4]]))
    [[1, 2], [3, 4]]
    """
    return [[matrix[i, j] for j in range(matrix.cols)] for i in range(matrix.rows)]


def symbols_of(expressions: Iterable[Any]) -> set[Any]:
    """Symbols of expressions and matrices.

    Examples
    --------
    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> sorted(symbols_of([x + 1, sp.Matrix([y])]), key=str)
    [x, y]
    """
    found: set[Any] = set()
    for expression in expressions:
        found |= expression.free_symbols
    return found


def operations(matrix: Any) -> int:
    """How many operations the entries of a matrix take together.

    Examples
    --------
    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> operations(sp.Matrix([[x + y, x * y + 1]]))
    3
    """
    return sum(int(entry.count_ops()) for entry in entries(matrix))
