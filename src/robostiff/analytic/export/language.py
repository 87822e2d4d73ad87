"""Documents in a language: words, displayed formulas, tables and names."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.export.blocks import (
    Block,
    EquationRows,
    FormulaTable,
    Nomenclature,
    Outer,
    Rows,
    Sentences,
    Title,
    Total,
)
from robostiff.analytic.export.broken_lines import (
    broken_lines,
    fitted,
    math_width,
    name_width,
    room_beside,
)
from robostiff.analytic.export.notation import Notation
from robostiff.analytic.vectors.vector_expressions import Equation, Vector
from robostiff.errors import printable


@dataclass(frozen=True)
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
                yield self.listed([(self.names(own), self.said(text)) for own, text in rows])
            case FormulaTable(head, rows, of):
                yield self.table(
                    [[self.said(x), *map(self.cell, own)] for x, own in ((of, head), *rows)]
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
        factor, matrix, named = fitted(block, math_width, room_beside(block, self.room))
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
            is_high = isinstance(expression, Rows | Outer | Total)
            width = math.inf if is_high else 6 + math_width(expression)
            return Row(name, (self.written(expression),), width)
        around = name_width(equation.name) + 4
        lines = broken_lines(expression, self, self.room - around)
        return Row(name, tuple(lines), math_width(expression) + around)
