"""Entries for which a matrix has no room: a name in their place, and an equation below."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.export.entries import rows
from robostiff.analytic.export.outline import Equations, MatrixEquation

Measure = Callable[[sp.Basic], float]


@dataclass(frozen=True)
class Displayed:
    """A matrix that fits: ``factor * matrix``, with names in it for what is too wide.

    Attributes
    ----------
    factor : sympy.Expr
    matrix : sympy.ImmutableMatrix
    named : Equations
        What the names stand for, in the order of reading.
    """

    factor: sp.Expr
    matrix: sp.ImmutableMatrix
    named: Equations


def displayed(
    block: MatrixEquation, measure: Measure, room: float, *, stacked: bool = False
) -> Displayed:
    """Fit a matrix into a width.

    Its common factor stands in front where all fits; otherwise the factor stays in the entries,
    and those that are too wide get a name.

    Parameters
    ----------
    block : MatrixEquation
    measure : callable
        Width of an expression.
    room : float
        For all columns side by side, in the same unit.
    stacked : bool
        Whether the factor may stand above the matrix.

    Examples
    --------
    >>> from robostiff.analytic.export.matrix_names import MatrixName
    >>> a, b = sp.symbols("a b")
    >>> matrix = sp.ImmutableMatrix([[a, a + b], [a + b, b]])
    >>> block = MatrixEquation(
    ...     MatrixName("K"), sp.Integer(1), matrix, matrix, lambda i, j: f"K_{i + 1}{j + 1}"
    ... )
    >>> displayed(block, lambda e: len(str(e)), 6)
    Displayed(factor=1, matrix=Matrix([
    [   a, K_12],
    [K_12,    b]]), named=Equations(rows=(('K_12', a + b),)))
    """
    taken = measure(block.factor) if block.factor != 1 else 0
    needed = sum(_columns(block.matrix, measure)) + (0 if stacked else taken)
    if needed <= room and taken <= room / 2:
        return Displayed(block.factor, block.matrix, Equations(()))
    return _named(block, measure, _limit(_columns(block.whole, measure), room))


def _named(block: MatrixEquation, measure: Measure, limit: float) -> Displayed:
    """Names for the entries that are wider than a limit; equal entries share one."""
    names: dict[Any, sp.Symbol] = {}
    shown: list[Any] = []
    whole = block.whole
    for i, row in enumerate(rows(whole)):
        for j, entry in enumerate(row):
            if not entry.is_Atom and entry not in names and measure(entry) > limit:
                names[entry] = sp.Symbol(block.entry_name(i, j))
            shown.append(names.get(entry, entry))
    matrix = sp.ImmutableMatrix(whole.rows, whole.cols, shown)
    named = tuple((symbol.name, entry) for entry, symbol in names.items())
    return Displayed(sp.Integer(1), matrix, Equations(named))


def _columns(matrix: sp.ImmutableMatrix, measure: Measure) -> list[float]:
    widths = [[measure(entry) for entry in row] for row in rows(matrix)]
    return [max(column) for column in zip(*widths, strict=True)]


def _limit(columns: list[float], room: float) -> float:
    """Widest entry for which all columns fit; columns that need less leave their share."""
    columns = sorted(columns)
    for narrower, width in enumerate(columns):
        share = (room - sum(columns[:narrower])) / (len(columns) - narrower)
        if width > share:
            return share
    return columns[-1]
