"""Blocks as Typst, for PDF."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import TypeVar

from robostiff.errors import printable
from robostiff.markup.blocks import (
    Block,
    Bullets,
    Cell,
    Facts,
    Folded,
    Heading,
    LabelledMatrix,
    Number,
    Paragraph,
    Section,
    SideBySide,
    Table,
    Tone,
    Verbatim,
)
from robostiff.markup.numbers import number, numeral_typst, shown_matrix, typeset

_SPECIAL = re.compile(r"([\\#*_`$<>@\[\]~=/\"'+.-])")

#: Definitions that a document needs before its first block.
TYPST_BLOCKS = """\
#let advice(body) = block(
  width: 100%, fill: rgb("#fff4e0"), stroke: (left: 3pt + rgb("#8a4b00")), inset: 8pt, body,
)
#let rows(columns, sides, ..cells) = block(above: 1em, below: 1em, table(
  columns: columns, stroke: none, inset: (x: 5pt, y: 2.2pt), align: sides,
  table.hline(y: 1, stroke: 0.5pt), ..cells,
))
#let entries(symbol, units, size, second, ..cells) = block(breakable: false, above: 1.2em, {
  set text(size: 8pt)
  table(
    columns: size + 1, stroke: none, inset: (x: 4pt, y: 3.5pt), align: right,
    table.vline(x: 1, start: 1, stroke: 1pt), table.vline(x: size + 1, start: 1, stroke: 1pt),
    table.vline(x: second + 1, start: 1, stroke: (thickness: 0.4pt, dash: "dotted")),
    table.hline(y: second + 1, start: 1, stroke: (thickness: 0.4pt, dash: "dotted")),
    strong(symbol), ..cells,
  )
  text(fill: luma(90), units)
})
"""


def typst_text(text: str) -> str:
    r"""Text for Typst: special characters escaped, numbers as in tables of numbers.

    Examples
    --------
    >>> typst_text("joint #1"), typst_text("4e+08 N")
    ('joint \\#1', '$4 dot 10^(8)$ N')
    """
    shown = printable(" ".join(text.split()))
    return typeset(shown, lambda words: _SPECIAL.sub(r"\\\1", words), numeral_typst)


def block_typst(block: Block) -> str:  # noqa: PLR0911
    """A block in Typst; documents begin with `TYPST_BLOCKS`.

    Examples
    --------
    >>> print(block_typst(Table(["part", "share"], [["rod", Number(12.0, "%")]])))
    #rows(2, (left, right,), table.header([part], [share]),
      [rod], [$12$ %],
    )
    """
    match block:
        case Paragraph(text, tone):
            return _in_tone(typst_text(text), tone)
        case Heading(text):
            return f"== {typst_text(text)}"
        case Bullets(items, tone):
            return _in_tone("\n".join(f"- {typst_text(item)}" for item in items), tone)
        case Facts(rows):
            cells = [
                f"  [#text(fill: luma(90))[{typst_text(a)}]], [{typst_text(b)}]," for a, b in rows
            ]
            start = "#table(columns: (auto, 1fr), stroke: none, inset: (x: 3pt, y: 2.5pt),"
            return "\n".join([start, *cells, ")"])
        case Table():
            title = [f"{typst_text(block.title)}\n"] if block.title else []
            parts = _halves(block.rows) if block.is_long else (block.rows,)
            rows = [_rows(block, own) for own in parts]
            return "\n".join([*title, _beside(rows) if block.is_long else rows[0]])
        case LabelledMatrix():
            return _matrix(block)
        case Verbatim(text):
            lines = printable(text, kept="\n\t").split("\n")
            halves = map(typst_string, map("\n".join, _halves(lines)))
            return _beside(f"#text(size: 5.5pt, raw({half}, block: true))" for half in halves)
        case Folded(title, blocks):
            return f"== {typst_text(title)}\n\n{blocks_typst(blocks)}"
        case SideBySide(columns):
            each = [own if isinstance(own, tuple) else (own,) for own in columns]
            if any(isinstance(own, LabelledMatrix) for (own, *_) in each):  # as wide as a page
                return "\n\n".join(map(blocks_typst, each))
            whole = all(isinstance(own, Table) for column in each for own in column)
            return _beside(map(blocks_typst, each), "auto" if whole else "1fr")
        case Section(_, title, blocks):
            return f"= {typst_text(title)}\n\n{blocks_typst(blocks)}"
        case _:
            return block.typst()


_KNOWN = (
    *(Paragraph, Heading, Bullets, Facts, Table),
    *(LabelledMatrix, Verbatim, Folded, SideBySide, Section),
)


def blocks_typst(blocks: Iterable[Block | None]) -> str:
    """Blocks one after the other, two figures in a row side by side; None is left out."""
    written = []
    each = (block for block in blocks if block is not None)
    for is_known, group in groupby(each, lambda block: isinstance(block, _KNOWN)):
        own = list(map(block_typst, group))
        written += own if is_known or len(own) == 1 else [_beside(own)]
    return "\n\n".join(written)


def typst_string(text: str) -> str:
    """Text as a string of Typst, in quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _beside(cells: Iterable[str], width: str = "1fr") -> str:
    """Cells side by side, two in a row."""
    listed = ",\n".join(f"[{cell}]" for cell in cells)
    gaps = "column-gutter: 1.5em, row-gutter: 1em"
    return f"#grid(columns: ({width}, {width}), {gaps},\n{listed})"


_Row = TypeVar("_Row")


def _halves(rows: Sequence[_Row]) -> tuple[Sequence[_Row], Sequence[_Row]]:
    middle = (len(rows) + 1) // 2
    return rows[:middle], rows[middle:]


def _in_tone(text: str, tone: Tone) -> str:
    match tone:
        case Tone.PLAIN:
            return text
        case Tone.QUIET:
            return f"#text(size: 8pt)[{text}]"
        case Tone.WARNING:
            return f"#advice[\n{text}\n]"


def _rows(block: Table, rows: Sequence[Sequence[Cell]]) -> str:
    head = ", ".join(f"[{typst_text(name)}]" for name in block.header)
    lines = []
    for row in rows:
        cells = [
            numeral_typst(number(float(own.value)))
            + (f" {typst_text(own.unit)}" if own.unit else "")
            if isinstance(own, Number)
            else typst_text(own)
            for own in row
        ]
        lines.append("  " + ", ".join(f"[{cell}]" for cell in cells) + ",")
    # automatic widths, except for a column that holds sentences
    longest = [
        max((len(cell) for cell in column if isinstance(cell, str)), default=0)
        for column in zip(*block.rows, strict=True)
    ]
    columns = str(len(block.header))
    if max(longest, default=0) >= 60:
        wide = longest.index(max(longest))
        columns = f"({', '.join('1fr' if i == wide else 'auto' for i in range(len(longest)))})"
    sides = ", ".join("right" if own else "left" for own in block.of_numbers)
    start = f"#rows({columns}, ({sides},), table.header({head}),"
    return "\n".join([start, *lines, ")"])


def _matrix(block: LabelledMatrix) -> str:
    head = "".join(f" strong[{typst_text(name)}]," for name in block.columns)
    symbol, units = typst_text(block.symbol), typst_text(f"[{block.units}]")
    start = f"#entries([{symbol}], [{units}], {len(block.rows)}, {block.first_rotation},"
    lines = [start, f"  {head}"]
    for name, values in zip(block.rows, shown_matrix(block.values), strict=True):
        cells = ", ".join(f"[{numeral_typst(number(float(value)))}]" for value in values)
        lines.append(f"  strong[{typst_text(name)}], {cells},")
    return "\n".join([*lines, ")"])
