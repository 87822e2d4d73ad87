"""Displayed formulas: the blocks of an outline, large entries below their matrix."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.export.broken_lines import Breaks, broken_lines, math_width, name_width
from robostiff.analytic.export.entries import MatrixName
from robostiff.analytic.export.outline import (
    Displayable,
    EqualMatrices,
    FormulaTable,
    LegSum,
    MatrixEquation,
    OutlineText,
    Recursion,
    ScalarEquations,
    SpringSum,
    Transport,
    VectorEquations,
    WrenchSum,
)
from robostiff.analytic.export.products import is_word
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Norm,
    Over,
    Stacked,
    Sum,
    Times,
    Turned,
    Turns,
    Vector,
)
from robostiff.analytic.vectors.vector_form import Equation


def written_vector(expression: Any, language: MathLanguage) -> str:
    """An expression of vectors in a language."""

    def write(part: Any) -> str:
        return written_vector(part, language)

    def half(part: Any) -> str:
        return language.number(0) if part is None else write(part)

    def factor(part: Any) -> str:
        is_bare = not isinstance(part, Sum | Turned | Times | Cross)
        return write(part) if is_bare else language.brackets(write(part))

    match expression:
        case Vector(name):
            found = language.matrix_name(name)
        case Coordinates(entries):
            found = language.brackets(", ".join(map(language.breaks.write, entries)))
        case Sum(terms):
            signed = [(" - " if sign < 0 else " + ") + write(term) for sign, term in terms]
            found = "".join(signed).removeprefix(" + ").replace(" - ", "-", terms[0][0] < 0)
        case Turned(rotation, vector):
            found = f"{language.matrix_name(rotation)} {factor(vector)}"
        case Over(vector, scalar):
            found = language.fraction(write(vector), write(scalar))
        case Times(scalar, vector):
            number = language.breaks.write(scalar)
            number = language.brackets(number) if scalar.is_Add else number
            is_apart = isinstance(scalar, sp.Symbol) and is_word(scalar.name)
            found = f"{number}{language.apart if is_apart else ' '}{factor(vector)}"
        case Cross(left, right):
            found = f"{factor(left)} {language.times} {factor(right)}"
        case Dot(left, right):
            found = f"{factor(left)} {language.dot} {factor(right)}"
        case Norm(vector):
            found = language.norm(write(vector))
        case Stacked(force, moment):
            found = language.matrix([[half(force)], [half(moment)]])
        case Turns(turns):
            named = ((language.matrix_name(f"R_{axis}"), write(x)) for axis, x in turns)
            found = " ".join(f"{R}{language.brackets(angle)}" for R, angle in named)
        case _:
            found = language.breaks.write(expression)
    return found


Measure = Callable[[sp.Basic], float]


@dataclass(frozen=True)
class Displayed:
    """A matrix that fits: ``factor * matrix``, with names for entries that are too wide."""

    factor: sp.Expr
    matrix: sp.ImmutableMatrix
    named: ScalarEquations  # what the names stand for, in the order of reading


def displayed(
    block: MatrixEquation, measure: Measure, room: float, *, stacked: bool = False
) -> Displayed:
    """Fit a matrix into a width.

    Its common factor stands in front where all fits; otherwise the factor stays in the entries,
    and those that are too wide get a name. The `room` is that of all columns side by side, in the
    unit of `measure`; `stacked` says that the factor may stand above the matrix.
    """
    taken = measure(block.factor) if block.factor != 1 else 0
    needed = sum(_columns(block.matrix, measure)) + (0 if stacked else taken)
    if needed <= room and taken <= room / 2:
        return Displayed(block.factor, block.matrix, ScalarEquations(()))
    return _named(block, measure, _limit(_columns(block.whole, measure), room))


def _named(block: MatrixEquation, measure: Measure, limit: float) -> Displayed:
    """Names for entries wider than a limit; those that are equal up to their sign share one."""
    names: dict[Any, Any] = {}
    named: dict[Any, sp.Symbol] = {}
    shown: list[Any] = []
    whole = block.whole
    all_entries = set(whole.flat())  # both signs of one get a name, or none
    for i, row in enumerate(whole.tolist()):
        for j, entry in enumerate(row):
            short = entry.is_Atom and not entry.is_Float
            width = max(measure(x) for x in (entry, -entry) if x in all_entries)
            if not short and entry not in names and width > limit:
                names[entry] = named[entry] = sp.Symbol(block.entry_name(i, j))
                names.setdefault(-entry, -names[entry])
            shown.append(names.get(entry, entry))
    matrix = sp.ImmutableMatrix(whole.rows, whole.cols, shown)
    rows_named = tuple((symbol.name, entry) for entry, symbol in named.items())
    return Displayed(sp.Integer(1), matrix, ScalarEquations(rows_named))


def _columns(matrix: sp.ImmutableMatrix, measure: Measure) -> list[float]:
    widths = [[measure(entry) for entry in row] for row in matrix.tolist()]
    return [max(column) for column in zip(*widths, strict=True)]


def _limit(columns: list[float], room: float) -> float:
    """Widest entry for which all columns fit; narrow columns leave space for the others."""
    columns = sorted(columns)
    for narrower, width in enumerate(columns):
        share = (room - sum(columns[:narrower])) / (len(columns) - narrower)
        if width > share:
            return share
    return columns[-1]


# Between two columns of a matrix, and around it [widths of a letter].
_GAP = 1.8
_AROUND = 3.0


@dataclass(frozen=True)
class MathLanguage:
    """Functions that write mathematics in a language."""

    breaks: Breaks  # expressions, and how they are broken over lines
    name: Callable[[str], str]  # name of a scalar
    matrix_name: Callable[[str], str]  # name of a matrix or vector
    matrix: Callable[[list[list[str]]], str]  # rows of written entries as a matrix
    fraction: Callable[[str, str], str]  # of two written expressions
    transposed: str  # what follows a transposed matrix
    total: str  # A sum over all
    inverse: str  # what follows an inverted matrix
    times: str  # the cross of a vector product
    apart: str  # A space between a word and what it multiplies
    number: Callable[[int], str]  # A whole number
    dot: str  # the point of a scalar product
    norm: Callable[[str], str]  # the length of a written vector
    total_over: Callable[[str], str]  # a sum over an index, such as that of legs
    inline: Callable[[str], str]  # A formula in a sentence
    brackets: Callable[[str], str]  # round, as high as what is in them


def listed_names(names: Sequence[MatrixName | str], language: MathLanguage, dots: str = "…") -> str:
    """Names in a sentence, each a formula of its own."""
    return ", ".join(dots if x == "..." else in_cell(x, language) for x in names)


def in_cell(part: MatrixName | str | Coordinates | sp.Expr | Sum, language: MathLanguage) -> str:
    """A vector, a name or an expression as a formula in a sentence or in a cell of a table."""
    if isinstance(part, Coordinates):
        return language.inline(written_vector(part, language))
    if isinstance(part, MatrixName):
        return language.inline(language.matrix_name(part.name))
    is_name = isinstance(part, str)
    return language.inline(language.name(part) if is_name else written_vector(part, language))


def sentences(block: OutlineText, language: MathLanguage, words: Callable[[str], str]) -> str:
    """A paragraph with the formulas in it; `words` writes what is between two of them."""
    between = " ".join(block.text.split()).split("{}", len(block.formulas))
    written = [x.replace(x.strip(), words(x.strip())) if x.strip() else x for x in between]
    formulas = [in_cell(x, language) for x in block.formulas]
    return "".join(x + y for x, y in zip(written, [*formulas, ""], strict=True))


def table_cells(table: FormulaTable, language: MathLanguage) -> list[list[str]]:
    """The head of a table and its rows, of which the first cells are words."""
    rows = [(table.of, table.head), *table.rows]
    return [[words, *(in_cell(x, language) for x in own)] for words, own in rows]


@dataclass(frozen=True)
class Row:
    """An equation of which the right-hand side takes one or more lines."""

    left: str
    lines: tuple[str, ...]
    width: float = math.inf  # estimate of its width, where it is on one line [widths of a letter]


Display = tuple[Row, ...]


def displays(
    block: Displayable,
    language: MathLanguage,
    room: float,
) -> list[Display]:
    """Write a block as displayed formulas, each of one or more equations below one another.

    The width `room` of the page is in widths of a letter.
    """

    def named(matrix: MatrixName) -> str:
        return language.matrix_name(matrix.name)

    match block:
        case ScalarEquations(rows):
            return [tuple(_equation(name, e, language, room) for name, e in rows)]
        case VectorEquations(equations):
            return [tuple(_vector_equation(e, language, room) for e in equations)]
        case MatrixEquation():
            return _matrix(block, language, room)
        case Transport(after, before, axes, arm):
            R, v, none = named(axes), named(arm), language.number(0)
            moved = language.matrix([[R, none], [f"({v} {language.times}) {R}", R]])
            T = language.matrix_name("T")
            whole = f"{T} {named(before)} {T}{language.transposed}"
            return [(Row(named(after), (whole,)), Row(T, (moved,)))]
        case Recursion(left, before, u, mu):
            above = f"{named(u)} {named(u)}{language.transposed}"
            written = f"{named(before)} - {language.fraction(above, language.name(mu))}"
        case WrenchSum(left):
            w = language.matrix_name("w")
            part = language.fraction(f"{w} {w}{language.transposed}", language.name("c"))
            written = f"{language.total} {part}"
        case LegSum() | SpringSum():
            is_legs = isinstance(block, LegSum)
            return [_sum_of_legs(block, language) if is_legs else _sum_of_springs(block, language)]
        case EqualMatrices(left, right, inverted):
            written = named(right) + (language.inverse if inverted else "")
    return [(Row(named(left), (written,)),)]


def _sum_of_legs(block: LegSum, language: MathLanguage) -> Display:
    """A sum over legs, before it where they share energy the wrenches of one and what they meet."""
    named = language.matrix_name
    K, over = named(block.result.name), language.total_over("i")
    if block.coupled:
        W, C = named("W_i"), named("C_i")
        columns = language.matrix([[named(w) for w, _ in block.wrenches]])
        entries = [
            [language.name(c) if c else language.number(0) for c in row] for row in block.coupled
        ]
        whole = f"{over} {W} {C}{language.inverse} {W}{language.transposed}"
        return Row(W, (columns,)), Row(C, (language.matrix(entries),)), Row(K, (whole,))
    parts = [
        language.fraction(f"{named(w)} {named(w)}{language.transposed}", language.name(c))
        for w, c in (*block.wrenches, *([block.rods] if block.rods else []))
    ]
    if block.rods:
        parts[-1] = f"{language.total_over('j')} {parts[-1]}"
    inner = parts[0] if len(parts) == 1 else language.brackets(" + ".join(parts))
    return (Row(K, (f"{over} {inner}",)),)


def _sum_of_springs(block: SpringSum, language: MathLanguage) -> Display:
    """A compliance, and by what the twists of a beam are moved to the reference point."""
    t, T, D, Q, m = (language.matrix_name(name) for name in "tTDQm")
    parts = [f"{language.total} {language.name('c')} {t} {t}{language.transposed}"] * block.drives
    parts += [f"{language.total} {T} {D} {T}{language.transposed}"] * block.beams
    rows = [Row(language.matrix_name(block.result.name), (" + ".join(parts),))]
    if block.beams:
        moved = [[Q, f"({m} {language.times}) {Q}"], [language.number(0), Q]]
        rows.append(Row(T, (language.matrix(moved),)))
    return tuple(rows)


def _vector_equation(equation: Equation, language: MathLanguage, room: float) -> Row:
    if isinstance(equation.expression, sp.Expr):
        return _equation(equation.name, equation.expression, language, room)
    name = language.matrix_name if equation.is_vector else language.name
    written = written_vector(equation.expression, language)
    return Row(name(equation.name), (written,), 6 + _vector_width(equation.expression))


def _vector_width(part: Any) -> float:
    """Estimate of the width of a written vector [widths of a letter]."""
    if isinstance(part, sp.Expr):
        return math_width(part)
    parts = [getattr(part, x.name) for x in fields(part)] if is_dataclass(part) else part
    return 2 + sum(map(_vector_width, parts)) if isinstance(parts, list | tuple) else 2


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
        bare = language.brackets(factor) if isinstance(fitting.factor, sp.Add) else factor
        written = f"{bare} {written}"
    formulas: list[Display] = [(Row(language.matrix_name(block.name.name), (written,)),)]
    if fitting.named.rows:
        formulas += displays(fitting.named, language, room)
    return formulas
