"""Displayed formulas: the blocks of an outline in a language for mathematics."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from robostiff.analytic.export.breakout import displayed
from robostiff.analytic.export.broken_lines import Breaks, broken_lines
from robostiff.analytic.export.math_width import math_width, name_width
from robostiff.analytic.export.matrix_names import MatrixName
from robostiff.analytic.export.outline import (
    Equations,
    MatrixEquation,
    Recursion,
    Same,
    WrenchSum,
)

# Between two columns of a matrix, and around it [widths of a letter].
_GAP = 1.8
_AROUND = 3.0


@dataclass(frozen=True)
class MathLanguage:
    """How a language writes mathematics.

    Attributes
    ----------
    breaks : Breaks
        Expressions, and how they are broken over lines.
    name : callable
        Name of a scalar.
    matrix_name : callable
        Name of a matrix or vector.
    matrix : callable
        Rows of written entries as a matrix.
    fraction : callable
        Of two written expressions.
    transposed : str
        What follows a transposed matrix.
    total : str
        A sum over all.
    """

    breaks: Breaks
    name: Callable[[str], str]
    matrix_name: Callable[[str], str]
    matrix: Callable[[list[list[str]]], str]
    fraction: Callable[[str, str], str]
    transposed: str
    total: str


@dataclass(frozen=True)
class Row:
    """An equation of which the right-hand side takes one or more lines.

    Attributes
    ----------
    left : str
    lines : tuple of str
    width : float
        Estimate of its width, where it is on one line [widths of a letter].
    """

    left: str
    lines: tuple[str, ...]
    width: float = math.inf


Display = tuple[Row, ...]


def displays(
    block: Equations | MatrixEquation | Recursion | Same | WrenchSum,
    language: MathLanguage,
    room: float,
) -> list[Display]:
    """Write a block as displayed formulas, each of one or more equations below one another.

    Parameters
    ----------
    block : Equations, MatrixEquation, Recursion, Same or WrenchSum
    language : MathLanguage
    room : float
        Width of the page in widths of a letter.
    """

    def named(matrix: MatrixName) -> str:
        return language.matrix_name(matrix.name)

    match block:
        case Equations(rows):
            return [tuple(_equation(name, e, language, room) for name, e in rows)]
        case MatrixEquation():
            return _matrix(block, language, room)
        case Recursion(after, before, u, mu):
            above = f"{named(u)} {named(u)}{language.transposed}"
            change = language.fraction(above, language.name(mu))
            return [(Row(named(after), (f"{named(before)} - {change}",)),)]
        case WrenchSum(result):
            w = language.matrix_name("w")
            part = language.fraction(f"{w} {w}{language.transposed}", language.name("c"))
            return [(Row(named(result), (f"{language.total} {part}",)),)]
        case Same(left, right):
            return [(Row(named(left), (named(right),)),)]


def _equation(name: str, expression: sp.Expr, language: MathLanguage, room: float) -> Row:
    around = name_width(name) + 4
    lines = broken_lines(expression, language.breaks, room - around)
    return Row(language.name(name), tuple(lines), math_width(expression) + around)


def _matrix(block: MatrixEquation, language: MathLanguage, room: float) -> list[Display]:
    around = name_width(block.name.name) + 2 + _AROUND + _GAP * (block.whole.cols - 1)
    fitting = displayed(block, math_width, room - around)
    write = language.breaks.write
    entries = [[write(e) for e in fitting.matrix.row(i)] for i in range(fitting.matrix.rows)]
    written = language.matrix(entries)
    if block.is_vector:
        written += language.transposed
    if fitting.factor != 1:
        factor = write(fitting.factor)
        bare = f"({factor})" if isinstance(fitting.factor, sp.Add) else factor
        written = f"{bare} {written}"
    formulas: list[Display] = [(Row(language.matrix_name(block.name.name), (written,)),)]
    if fitting.named.rows:
        formulas += displays(fitting.named, language, room)
    return formulas
