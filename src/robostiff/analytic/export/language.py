"""Documents in a language: words, displayed formulas in lines that fit, tables and names."""

from __future__ import annotations

import math
import re
import textwrap
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import accumulate, pairwise
from typing import Any, ClassVar

import sympy as sp

from robostiff.analytic.export.entries import GREEK, ordered_terms, printed_product
from robostiff.analytic.export.notation import (
    Block,
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
    Notation,
    Sentences,
    Title,
)
from robostiff.analytic.vectors.vector_expressions import Equation, Vector
from robostiff.errors import printable
from robostiff.frozen import frozen

# Between two columns of a matrix, and around it [widths of a letter].
_GAP = 1.8
_AROUND = 3.0
_LETTER = 10 * "x"


class _Widths(Notation):
    """Ten characters for the width of a letter; fractions stand upright, subscripts are small."""

    minus = plus = 2 * _LETTER
    beside, apart, partial = "xx", "xx", _LETTER
    transposed = inverse = total = total_over = _LETTER
    cross, dot, norm = _LETTER, "xx", _LETTER + "{}" + _LETTER
    root, scientific, brackets = "{}" + _LETTER, "{}{}" + 3 * _LETTER, _LETTER + "{}" + _LETTER
    constants: ClassVar[dict[str, str]] = {"pi": _LETTER, "e": _LETTER}

    def word(self, word: str) -> str:
        return _LETTER * (1 if word in GREEK else len(word))

    def bold(self, letter: str) -> str:
        return self.word(letter)

    def number(self, digits: str) -> str:
        return self.word(digits)

    def subscripted(self, letter: str, primes: int, subscripts: Sequence[str]) -> str:
        return letter + primes * "xxxxx" + "".join(self.raise_to("xxxx", x) for x in subscripts)

    def raise_to(self, base: str, power: str) -> str:
        return base + power[: 7 * len(power) // 10]

    def over(self, above: str, below: str) -> str:
        return max(above, below, key=len) + "xxxxx"

    def matrix(self, rows: list[list[str]]) -> str:
        return 2 * _LETTER + max(map("".join, rows), key=len)

    def applied(self, function: Any, power: str = "") -> str:
        name = self.raise_to(_LETTER * (1 + len(type(function).__name__)), power)
        return name + "".join(self._print(x) + _LETTER for x in function.args)

    def times(self, factor: str, *, apart: bool) -> str:
        return self.beside


_WIDTHS = _Widths()


def math_width(expression: Any) -> float:
    """Estimate the width of a typeset expression, of scalars or vectors, in widths of a letter."""
    return len(_WIDTHS.written(expression).replace("-", _LETTER)) / len(_LETTER)


def name_width(name: str) -> float:
    """Estimate the width of a typeset name, its subscripts small."""
    return len(_WIDTHS.name(name)) / len(_LETTER)


_Piece = tuple[str, float]  # what is not broken, and its width


def broken_lines(expression: sp.Expr, language: Any, room: float) -> list[str]:
    """Write an expression on as many lines as it needs.

    The width `room` of a line is in widths of a letter; what cannot be broken may be wider.
    """
    if math_width(expression) <= room:
        return [language.write(expression)]
    lines, filled = [""], 0.0
    for text, width in _pieces(expression, language, room):
        if lines[-1] and filled + width > room:
            lines.append("")
            filled = 0.0
        lines[-1] = f"{lines[-1]} {text}".lstrip()
        filled += width
    return lines


def _pieces(expression: Any, language: Any, room: float) -> list[_Piece]:
    """The pieces of an expression that are not broken, in order."""
    width = math_width(expression)
    # A sum that fits is still broken if otherwise half of the line before it stayed empty.
    if expression.is_Add and width > room / 4:
        pieces = _pieces((terms := ordered_terms(expression))[0], language, room)
        for term in terms[1:]:
            (text, size), *rest = _pieces(term, language, room)
            sign, bare = ("-", text[1:]) if text[0] == "-" else ("+", text)
            pieces += [(f"{sign} {bare.lstrip()}", size + 2), *rest]
        return pieces
    product = printed_product(expression)
    is_alone = len(product.above) == 1 and not _is_power_of_a_sum(product.above[0])
    if width <= room or (is_alone and not product.below and not product.negative):
        return [(language.write(expression), width)]
    (text, size), *rest = _factors(product.above, language, room)
    pieces = [(f"-{text}", size + 1) if product.negative else (text, size), *rest]
    if product.below:
        below = _factors(product.below, language, room)
        (text, size), *rest = _in_brackets(below, language) if len(product.below) > 1 else below
        pieces += [(f"{language.slash} {text}", size + 1), *rest]
    return pieces


def _factors(factors: tuple[Any, ...], language: Any, room: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for x in factors:
        if x.is_Add:
            pieces += _in_brackets(_pieces(x, language, room), language)
        elif _is_power_of_a_sum(x) and math_width(x) > room:
            *first, (text, size) = _in_brackets(_pieces(x.base, language, room), language)
            power = language.power.replace("{}", language.write(x.exp))
            pieces += [*first, (f"{text}{power}", size + 1)]
        else:
            pieces += _pieces(x, language, room)
    return pieces or [("1", 1.0)]


def _is_power_of_a_sum(factor: Any) -> bool:
    return factor.is_Pow and factor.base.is_Add and factor.exp.is_Integer and factor.exp > 1


def _in_brackets(pieces: list[_Piece], language: Any) -> list[_Piece]:
    (text, size), *rest = pieces
    *first, (last, width) = [(f"{language.opening} {text}", size + 1), *rest]
    return [*first, (f"{last} {language.closing}", width + 1)]


def room_beside(block: MatrixEquation, room: float) -> float:
    """The room that a name and brackets leave for the columns [widths of a letter]."""
    return room - name_width(block.name) - 2 - _AROUND - _GAP * (block.whole.cols - 1)


def fit(
    block: MatrixEquation, measure: Callable[[Any], float], room: float, *, stacked: bool = False
) -> tuple[Any, sp.ImmutableMatrix, EquationRows]:
    """Factor, matrix, and what names in it stand for, of a matrix that fits into a width.

    Its common factor stands in front where all fits, and has a name where it is long; otherwise
    it stays in the entries, and those that are too wide get a name; those that are equal up to
    their sign share one. The `room` is that of all columns side by side, in the unit of `measure`;
    `stacked` says that the factor may stand above the matrix.
    """

    def widths(matrix: Any) -> list[float]:
        return sorted(max(map(measure, matrix.col(j))) for j in range(matrix.cols))

    whole = block.whole
    taken = 0 if block.factor == 1 else measure(block.factor)
    rest = whole if block.rest is None else block.rest
    needed = sum(widths(rest))
    if needed + (0 if stacked else taken) <= room and taken <= room / 2:
        return block.factor, rest, EquationRows(())
    name = f"{block.name}_f"
    if needed + len(name) <= room and block.rest is not None and block.factor != 1:
        named = Equation(name, block.factor)
        return sp.Symbol(name), rest, EquationRows((named,))
    columns = widths(whole)
    # The widest entry for which all columns fit; narrow columns leave space for the others.
    shares = [(room - sum(columns[:n])) / (len(columns) - n) for n in range(len(columns))]
    pairs = zip(columns, shares, strict=True)
    limit = next((share for width, share in pairs if width > share), columns[-1])
    names: dict[Any, Any] = {}
    equations: list[Equation] = []
    all_entries = set(whole.flat())  # both signs of one get a name, or none
    for place, entry in enumerate(whole.flat()):
        if (entry.is_Atom and not entry.is_Float) or entry in names:
            continue
        if max(measure(x) for x in (entry, -entry) if x in all_entries) > limit:
            i, j = divmod(place, whole.cols)
            name = f"{block.name}_{'' if block.is_vector else i + 1}{j + 1}"
            names[entry] = sp.Symbol(name)
            names.setdefault(-entry, -names[entry])
            equations.append(Equation(name, entry))
    shown = [names.get(entry, entry) for entry in whole.flat()]
    matrix = sp.ImmutableMatrix(whole.rows, whole.cols, shown)
    return sp.S.One, matrix, EquationRows(tuple(equations))


_BEFORE_SIGN_OR_AFTER_COMMA = re.compile(r"(?<= )(?=[+-] )|(?<=, )|(?<=\)/)")
_AFTER_TIMES_OR_OVER = re.compile(r"(?<=[^*]\*)(?=[^*])|(?<=/)")


def wrapped_formula(text: str, width: int, first: str = "", rest: str = "    ") -> list[str]:
    """Break a formula before ``+`` and ``-``, and inside a term only where it is too long.

    `first` and `rest` stand before the first line and before the others, inside the `width`. What
    cannot be broken may be longer.
    """
    # Sums are broken between brackets before they are broken inside.
    room = width - max(len(first), len(rest))
    depths = [0, *accumulate((x == "(") - (x == ")") for x in text)]  # of brackets
    places = [m.start() for m in _BEFORE_SIGN_OR_AFTER_COMMA.finditer(text)]
    cuts = [0, len(text)]
    for depth in range(max(depths) + 1):
        at_depth = [place for place in places if depths[place] == depth]
        cuts = _cut_where_long(cuts, at_depth, room)
    at_factors = [m.start() for m in _AFTER_TIMES_OR_OVER.finditer(text)]
    cuts = _cut_where_long(cuts, at_factors, room)
    lines: list[str] = []
    line, started = first, False
    for token in (text[start:stop] for start, stop in pairwise(cuts)):
        if started and len((line + token).rstrip()) > width:
            lines.append(line.rstrip())
            line = rest
        line, started = line + token, True
    return [*lines, line.rstrip()]


def _cut_where_long(cuts: list[int], places: list[int], room: int) -> list[int]:
    """More cuts, inside the pieces that are longer than a line."""
    added = [
        place
        for start, stop in pairwise(cuts)
        if stop - start > room
        for place in places
        if start < place < stop
    ]
    return sorted({*cuts, *added})


def wrapped_words(text: str, width: int, rest: str = "") -> list[str]:
    """Break a sentence at blanks."""
    return textwrap.wrap(
        text, width, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False
    )


@frozen
class Row:
    """An equation of which the right-hand side takes one or more lines."""

    left: str
    lines: tuple[str, ...]
    width: float = math.inf  # estimate of its width, where it is on one line [widths of a letter]


class Language(Notation):
    """How a language writes the parts of a document.

    `room`: of a line [widths of a letter]; `first`: level of the first heading.
    """

    list_signs: tuple[Sequence[str], str, Sequence[str]]  # lines before, names and meaning, after
    dots: str = "…"

    def __init__(self, room: float = math.inf, first: int = 1) -> None:
        super().__init__()
        self.room: float = room
        self.first: int = first

    def at(self, room: float | None = None, first: int = 1) -> Language:
        """The same language with other lines, or below other headings."""
        return type(self)(self.room if room is None else room, first)

    def inline(self, formula: str) -> str:
        """A formula in a sentence."""
        return f"${formula}$"

    @abstractmethod
    def words(self, text: str) -> str:
        """Words, with what is special in the language escaped."""

    @abstractmethod
    def heading(self, text: str, level: int) -> str:
        """A title of written words."""

    @abstractmethod
    def table(self, rows: list[list[str]]) -> str:
        """Written cells, the head first."""

    @abstractmethod
    def display(self, rows: Sequence[Row]) -> Iterable[str]:
        """Equations below one another."""

    def paragraph(self, text: str) -> str:
        """Written sentences."""
        return text

    def listed(self, rows: Sequence[tuple[str, str]]) -> str:
        """Written names with their meanings."""
        start, item, end = self.list_signs
        return "\n".join([*start, *(item.format(*row) for row in rows), *end])

    def document(self, blocks: Iterable[Block]) -> list[str]:
        """All parts of a document."""
        return [text for block in blocks for text in self.part(block)]

    def part(self, block: Block) -> Iterator[str]:
        """A block, in one or more paragraphs."""
        match block:
            case Title(text, level):
                yield self.heading(self.said(text), level)
            case Sentences(text, formulas):
                between = " ".join(text.split()).split("{}", len(formulas))
                each = [
                    x.replace(x.strip(), self.said(x.strip())) if x.strip() else x for x in between
                ]
                pairs = zip(each, [*map(self.cell, formulas), ""], strict=True)
                yield self.paragraph("".join(x + y for x, y in pairs))
            case Nomenclature(rows):
                yield self.heading("Nomenclature", 2)
                yield self.listed([(self.names(names), self.said(text)) for names, text in rows])
            case FormulaTable(head, rows, of):
                yield self.table(
                    [[self.said(x), *map(self.cell, cells)] for x, cells in ((of, head), *rows)]
                )
            case _:
                for formula in self.formulas(block):
                    yield from self.display(formula)

    def said(self, text: str) -> str:
        """Words of anybody: without characters that are not printed."""
        return self.words(printable(text, kept="\n"))

    def names(self, names: Sequence[Vector | str]) -> str:
        """Names in a sentence, each a formula of its own."""
        return ", ".join(self.dots if x == "..." else self.cell(x) for x in names)

    def cell(self, part: Any) -> str:
        """A name or an expression as a formula in a sentence or in a cell of a table."""
        return self.inline(self.name(part) if isinstance(part, str) else self.written(part))

    def formulas(self, block: Any) -> list[list[Row]]:
        """A block as displayed formulas, each of one or more equations below one another."""
        if isinstance(block, EquationRows):
            return [[self._row(equation) for equation in block.rows]]
        factor, matrix, named = fit(block, math_width, room_beside(block, self.room))
        written = self.matrix([[self.write(e) for e in row] for row in matrix.tolist()])
        written += self.transposed * block.is_vector
        if factor != 1:
            before = self.write(factor)
            written = f"{self.in_brackets(before) if factor.is_Add else before} {written}"
        found = [[Row(self.name(block.name, bold=True), (written,))]]
        return [*found, *self.formulas(named)] if named.rows else found

    def _row(self, equation: Equation) -> Row:
        name = self.name(equation.name, bold=equation.is_vector)
        expression: Any = equation.expression
        if not isinstance(expression, sp.Expr):
            is_high = isinstance(expression, str) and re.match(r"sum|\[", expression)
            width = math.inf if is_high else 6 + math_width(expression)
            return Row(name, (self.written(expression),), width)
        around = name_width(equation.name) + 4
        lines = broken_lines(expression, self, self.room - around)
        return Row(name, tuple(lines), math_width(expression) + around)
