"""Blocks as Typst, for PDF."""

from __future__ import annotations

import re

from robostiff.errors import printable
from robostiff.markup.blocks import (
    Block,
    Bullets,
    Cell,
    Facts,
    Heading,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    Tone,
    number,
    shown_matrix,
)

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
    r"""Text for Typst, its special characters escaped.

    Examples
    --------
    >>> typst_text("joint #1")
    'joint \\#1'
    """
    return _SPECIAL.sub(r"\\\1", printable(" ".join(text.split())))


def typst_number(value: float) -> str:
    """A number with five digits, powers of ten raised.

    Examples
    --------
    >>> typst_number(-1234567.0), typst_number(0.25)
    ('$-1.2346 dot 10^(6)$', '$0.25$')
    """
    digits, _, exponent = number(value).partition("e")
    return f"${digits} dot 10^({int(exponent)})$" if exponent else f"${digits}$"


def block_typst(block: Block) -> str:
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
            return _table(block)
        case LabelledMatrix():
            return _matrix(block)


def _in_tone(text: str, tone: Tone) -> str:
    match tone:
        case Tone.PLAIN:
            return text
        case Tone.QUIET:
            return f"#text(size: 8pt)[{text}]"
        case Tone.WARNING:
            return f"#advice[\n{text}\n]"


def _table(block: Table) -> str:
    head = ", ".join(f"[{typst_text(name)}]" for name in block.header)
    lines = ["  " + ", ".join(f"[{_cell(cell)}]" for cell in row) + "," for row in block.rows]
    sides = ", ".join("right" if own else "left" for own in block.of_numbers)
    title = [f"{typst_text(block.title)}\n"] if block.title else []
    start = f"#rows({_columns(block)}, ({sides},), table.header({head}),"
    return "\n".join([*title, start, *lines, ")"])


def _columns(block: Table) -> str:
    """Widths of columns: automatic, except for columns that hold sentences."""
    longest = [
        max((len(cell) for cell in column if isinstance(cell, str)), default=0)
        for column in zip(*block.rows, strict=True)
    ]
    if max(longest, default=0) < 60:
        return str(len(block.header))
    wide = longest.index(max(longest))
    return f"({', '.join('1fr' if i == wide else 'auto' for i in range(len(longest)))})"


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Number):
        return typst_text(cell)
    unit = f" {typst_text(cell.unit)}" if cell.unit else ""
    return typst_number(float(cell.value)) + unit


def _matrix(block: LabelledMatrix) -> str:
    head = "".join(f" strong[{typst_text(name)}]," for name in block.columns)
    symbol, units = typst_text(block.symbol), typst_text(f"[{block.units}]")
    start = f"#entries([{symbol}], [{units}], {len(block.rows)}, {block.first_rotation},"
    lines = [start, f"  {head}"]
    for name, values in zip(block.rows, shown_matrix(block.values), strict=True):
        cells = ", ".join(f"[{typst_number(float(value))}]" for value in values)
        lines.append(f"  strong[{typst_text(name)}], {cells},")
    return "\n".join([*lines, ")"])
