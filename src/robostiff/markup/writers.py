"""Blocks as HTML, for pages and notebooks, and as Typst, for PDF; text comes out escaped."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from html import escape
from importlib import import_module
from importlib.util import find_spec
from itertools import groupby
from typing import Any, TypeVar

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
    Page,
    Paragraph,
    Section,
    SideBySide,
    Table,
    Tone,
    Verbatim,
)
from robostiff.markup.numbers import number, numeral_html, numeral_typst, shown_matrix, typeset


def escaped(text: object) -> str:
    """Text with the special characters of HTML escaped."""
    return escape(printable(str(text), kept="\n\t"))


def in_words(text: object) -> str:
    """A sentence or a cell of a table: escaped, with numbers as in tables of numbers."""
    return typeset(str(text), escaped, numeral_html)


def element(tag: str, content: str, **attributes: str) -> str:
    """An element around content that is HTML already; ``_`` in names of attributes is ``-``."""
    written = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{escaped(value)}"'
        for name, value in attributes.items()
    )
    return f"<{tag}{written}>{content}</{tag}>"


# Notebooks have no style sheet of ours: brackets and blocks of a matrix bring their own style.
_CELL = "text-align: right; padding: 0.15em 0.7em; font-variant-numeric: tabular-nums;"
_NAME = "font-weight: 600; padding: 0.15em 0.7em; text-align: center;"
_LEFT = "border-left: 2px solid currentColor;"
_RIGHT = "border-right: 2px solid currentColor;"
_BLOCK = "border-left: 1px dotted currentColor;"
_BELOW = "border-top: 1px dotted currentColor;"
_HTML_IN_TONE = {
    Tone.PLAIN: "{}",
    Tone.QUIET: '<div class="quiet">{}</div>',
    Tone.WARNING: '<div class="advice">{}</div>',
}


def block_html(block: Block) -> str:  # noqa: PLR0911
    """A block as HTML; numbers keep all their digits in ``<data value="...">``."""
    match block:
        case Paragraph(text, tone):
            return _HTML_IN_TONE[tone].format(element("p", in_words(text)))
        case Heading(text):
            return element("h3", escaped(text))
        case Bullets(items, tone):
            entries = "".join(element("li", in_words(item)) for item in items)
            return _HTML_IN_TONE[tone].format(element("ul", entries)) if items else ""
        case Facts(rows):
            rows_html = "".join(
                element("dt", escaped(a)) + element("dd", in_words(b)) for a, b in rows
            )
            return element("dl", rows_html) if rows else ""
        case Table():
            kind = "wide long" if block.is_long else "wide"
            return element("div", _table(block), class_=kind)
        case LabelledMatrix():
            return element("div", _html_matrix(block), class_="wide")
        case Verbatim(text):
            return element("pre", escaped(text))
        case Folded(title, blocks):
            return element("details", element("summary", escaped(title)) + blocks_html(blocks))
        case SideBySide(columns):
            stacks = (column if isinstance(column, tuple) else (column,) for column in columns)
            inner = "".join(element("div", blocks_html(stack)) for stack in stacks)
            return element("div", inner, class_="side-by-side")
        case Section(anchor, title, blocks):
            heading = element("h2", escaped(title))
            return element("section", f"{heading}\n{blocks_html(blocks)}", id=anchor)
        case _:
            return block.html()


def page_html(page: Page) -> str:
    """A page as HTML: name and status, its blocks, and advice."""
    status = "" if page.status is None else f"; status {element('b', escaped(page.status))}"
    name = element("b", escaped(page.name))
    lead = f"{escaped(page.before)}{name}{in_words(page.place)}{status}"
    blocks = [*page.blocks, Bullets(tuple(page.advice))]
    return element("div", element("p", lead) + blocks_html(blocks))


def blocks_html(blocks: Iterable[Block | None]) -> str:
    """Blocks one after the other; None is left out."""
    return "\n".join(block_html(block) for block in blocks if block is not None)


def _table(block: Table) -> str:
    kinds = [{"class_": "number"} if is_number else {} for is_number in block.of_numbers]
    names = zip(block.header, kinds, strict=True)
    head = "".join(element("th", escaped(name), scope="col", **kind) for name, kind in names)
    rows = ""
    for first, *cells in block.rows:
        row = element("th", _cell(first), scope="row")
        for cell, kind in zip(cells, kinds[1:], strict=True):
            row += element("td", _cell(cell), **kind)
        rows += element("tr", row)
    title = element("p", in_words(block.title)) if block.title else ""
    head = element("thead", element("tr", head)) if any(block.header) else ""
    return title + element("table", head + element("tbody", rows))


def _cell(cell: Cell) -> str:
    if not isinstance(cell, Number):
        return in_words(cell)
    unit = f" {escaped(cell.unit)}" if cell.unit else ""
    return _data(cell.value, cell.value) + unit


def _data(value: float, shown: float) -> str:
    return element("data", numeral_html(number(float(shown))), value=repr(float(value)))


def _html_matrix(block: LabelledMatrix) -> str:
    """A table with brackets; a dotted line separates translation from rotation."""
    n, second = len(block.rows), block.first_rotation
    names = "".join(
        element("th", escaped(name), scope="col", style=_NAME) for name in block.columns
    )
    lines = [element("tr", element("td", escaped(block.symbol), style=_NAME) + names)]
    for i, (name, values) in enumerate(zip(block.rows, shown_matrix(block.values), strict=True)):
        above = _BELOW if i == second and i else ""
        cells = [element("th", escaped(name), scope="row", style=_NAME)]
        for j, value in enumerate(values):
            side = _LEFT if j == 0 else _BLOCK if j == second else ""
            side += _RIGHT if j == n - 1 else ""
            number = _data(block.values[i, j], value)
            cells.append(element("td", number, style=_CELL + side + above))
        lines.append(element("tr", "".join(cells)))
    caption = element(
        "caption",
        escaped(f"[{block.units}]"),
        style="caption-side: bottom; opacity: 0.7;",
        title="upper left, off-diagonal, lower right block",
    )
    return element(
        "table",
        caption + "".join(lines),
        class_="robostiff-matrix",
        data_symbol=block.symbol,
        style="border-collapse: collapse; border: none; background: none;",
    )


# Pages are written and pictures drawn far above the results: imported when one is shown.
_PAGES, _PICTURES = "robostiff.page", "robostiff.plot.in_notebooks"


class InNotebooks:
    """A result that notebooks show as HTML, with its picture where it has one.

    Its tables are those of its page. A notebook shows one format of a result only, so the picture
    is part of the HTML. A terminal needs no HTML, and no picture is drawn there.
    """

    def _repr_html_(self) -> str:
        return page_html(import_module(_PAGES).page_of(self))

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        del include, exclude  # IPython selects by itself
        # the running IPython, if there is one, may show no HTML
        ipython: Any = sys.modules.get("IPython")
        shell = None if ipython is None else ipython.get_ipython()
        if shell is not None and "text/html" not in shell.display_formatter.active_types:
            return {}
        picture = ""
        if find_spec("matplotlib") is not None:
            picture = import_module(_PICTURES).picture_html(self)
        return {"text/html": self._repr_html_() + picture}


_TYPST_IN_TONE = {
    Tone.PLAIN: "{}",
    Tone.QUIET: "#text(size: 8pt)[{}]",
    Tone.WARNING: "#advice[\n{}\n]",
}
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
    r"""Text for Typst: special characters escaped, numbers as in tables of numbers."""
    shown = printable(" ".join(text.split()))
    return typeset(shown, lambda words: _SPECIAL.sub(r"\\\1", words), numeral_typst)


def block_typst(block: Block) -> str:  # noqa: PLR0911
    """A block in Typst; documents begin with `TYPST_BLOCKS`."""
    match block:
        case Paragraph(text, tone):
            return _TYPST_IN_TONE[tone].format(typst_text(text))
        case Heading(text):
            return f"== {typst_text(text)}"
        case Bullets(items, tone):
            return _TYPST_IN_TONE[tone].format("\n".join(f"- {typst_text(x)}" for x in items))
        case Facts(rows):
            cells = [
                f"  [#text(fill: luma(90))[{typst_text(a)}]], [{typst_text(b)}]," for a, b in rows
            ]
            start = "#table(columns: (auto, 1fr), stroke: none, inset: (x: 3pt, y: 2.5pt),"
            return "\n".join([start, *cells, ")"])
        case Table():
            title = [f"{typst_text(block.title)}\n"] if block.title else []
            parts = _halves(block.rows) if block.is_long else (block.rows,)
            rows = [_rows(block, half) for half in parts]
            return "\n".join([*title, _beside(rows) if block.is_long else rows[0]])
        case LabelledMatrix():
            return _typst_matrix(block)
        case Verbatim(text):
            lines = printable(text, kept="\n\t").split("\n")
            halves = map(typst_string, map("\n".join, _halves(lines)))
            return _beside(f"#text(size: 5.5pt, raw({half}, block: true))" for half in halves)
        case Folded(title, blocks):
            return f"== {typst_text(title)}\n\n{blocks_typst(blocks)}"
        case SideBySide(columns):
            stacks = [column if isinstance(column, tuple) else (column,) for column in columns]
            if any(isinstance(top, LabelledMatrix) for (top, *_) in stacks):  # as wide as a page
                return "\n\n".join(map(blocks_typst, stacks))
            whole = all(isinstance(inner, Table) for column in stacks for inner in column)
            return _beside(map(blocks_typst, stacks), "auto" if whole else "1fr")
        case Section(_, title, blocks):
            return f"= {typst_text(title)}\n\n{blocks_typst(blocks)}"
        case _:
            return block.typst()


def blocks_typst(blocks: Iterable[Block | None]) -> str:
    """Blocks one after the other, two figures in a row side by side; None is left out."""
    written = []
    present = (block for block in blocks if block is not None)
    for is_drawn, group in groupby(present, lambda block: hasattr(block, "typst")):
        parts = list(map(block_typst, group))
        written += [_beside(parts)] if is_drawn and len(parts) > 1 else parts
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


def _rows(block: Table, rows: Sequence[Sequence[Cell]]) -> str:
    head = ", ".join(f"[{typst_text(name)}]" for name in block.header)
    lines = []
    for row in rows:
        cells = [
            numeral_typst(number(float(cell.value)))
            + (f" {typst_text(cell.unit)}" if cell.unit else "")
            if isinstance(cell, Number)
            else typst_text(cell)
            for cell in row
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
    sides = ", ".join("right" if is_number else "left" for is_number in block.of_numbers)
    start = f"#rows({columns}, ({sides},), table.header({head}),"
    return "\n".join([start, *lines, ")"])


def _typst_matrix(block: LabelledMatrix) -> str:
    head = "".join(f" strong[{typst_text(name)}]," for name in block.columns)
    symbol, units = typst_text(block.symbol), typst_text(f"[{block.units}]")
    start = f"#entries([{symbol}], [{units}], {len(block.rows)}, {block.first_rotation},"
    lines = [start, f"  {head}"]
    for name, values in zip(block.rows, shown_matrix(block.values), strict=True):
        cells = ", ".join(f"[{numeral_typst(number(float(value)))}]" for value in values)
        lines.append(f"  strong[{typst_text(name)}], {cells},")
    return "\n".join([*lines, ")"])
