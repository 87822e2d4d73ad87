"""Blocks as HTML, for pages and notebooks; text comes out escaped."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from html import escape
from importlib import import_module
from importlib.util import find_spec
from typing import Any

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
from robostiff.markup.numbers import number, numeral_html, shown_matrix, typeset


def escaped(text: object) -> str:
    """Text with the special characters of HTML escaped.

    Examples
    --------
    >>> escaped("k < 2 & 'so on'")
    'k &lt; 2 &amp; &#x27;so on&#x27;'
    """
    return escape(printable(str(text), kept="\n\t"))


def in_words(text: object) -> str:
    """A sentence or a cell of a table: escaped, with numbers as in tables of numbers.

    Examples
    --------
    >>> in_words("k < 4e+08 N/m")
    'k &lt; 4·10<sup>8</sup> N/m'
    """
    return typeset(str(text), escaped, numeral_html)


def element(tag: str, content: str, **attributes: str) -> str:
    """An element around content that is HTML already; ``_`` in names of attributes is ``-``.

    Examples
    --------
    >>> element("td", "12", class_="number", data_unit="N/m")
    '<td class="number" data-unit="N/m">12</td>'
    """
    written = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{escaped(value)}"'
        for name, value in attributes.items()
    )
    return f"<{tag}{written}>{content}</{tag}>"


def listing(items: Iterable[str]) -> str:
    """A bulleted list of texts; empty without texts.

    Examples
    --------
    >>> listing(["a < b"]), listing([])
    ('<ul><li>a &lt; b</li></ul>', '')
    """
    entries = "".join(element("li", in_words(item)) for item in items)
    return element("ul", entries) if entries else ""


# Notebooks have no style sheet of ours: brackets and blocks of a matrix bring their own style.
_CELL = "text-align: right; padding: 0.15em 0.7em; font-variant-numeric: tabular-nums;"
_NAME = "font-weight: 600; padding: 0.15em 0.7em; text-align: center;"
_LEFT = "border-left: 2px solid currentColor;"
_RIGHT = "border-right: 2px solid currentColor;"
_BLOCK = "border-left: 1px dotted currentColor;"
_BELOW = "border-top: 1px dotted currentColor;"


def block_html(block: Block) -> str:  # noqa: PLR0911
    """A block as HTML; numbers keep all their digits in ``<data value="...">``.

    Examples
    --------
    >>> block_html(Paragraph("a < b"))
    '<p>a &lt; b</p>'
    >>> html = block_html(Table(["part", "share"], [["rod", Number(12.0, "%")]]))
    >>> html.partition("<tbody>")[2].removesuffix("</tbody></table></div>")
    '<tr><th scope="row">rod</th><td class="number"><data value="12.0">12</data> %</td></tr>'
    """
    match block:
        case Paragraph(text, tone):
            return _in_tone(element("p", in_words(text)), tone)
        case Heading(text):
            return element("h3", escaped(text))
        case Bullets(items, tone):
            return _in_tone(listing(items), tone) if items else ""
        case Facts(rows):
            rows_html = "".join(
                element("dt", escaped(a)) + element("dd", in_words(b)) for a, b in rows
            )
            return element("dl", rows_html) if rows else ""
        case Table():
            kind = "wide long" if block.is_long else "wide"
            return element("div", _table(block), class_=kind)
        case LabelledMatrix():
            return element("div", _matrix(block), class_="wide")
        case Verbatim(text):
            return element("pre", escaped(text))
        case Folded(title, blocks):
            return element("details", element("summary", escaped(title)) + blocks_html(blocks))
        case SideBySide(columns):
            each = (own if isinstance(own, tuple) else (own,) for own in columns)
            inner = "".join(element("div", blocks_html(own)) for own in each)
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


def _in_tone(html: str, tone: Tone) -> str:
    match tone:
        case Tone.PLAIN:
            return html
        case Tone.QUIET:
            return element("div", html, class_="quiet")
        case Tone.WARNING:
            return element("div", html, class_="advice")


def _table(block: Table) -> str:
    kinds = [{"class_": "number"} if own else {} for own in block.of_numbers]
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


def _matrix(block: LabelledMatrix) -> str:
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
