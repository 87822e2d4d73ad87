"""The sections of a report as a Typst document, and as a PDF."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import TypeVar

from robostiff.analytic.export.typst import (
    TYPST_DERIVATIONS,
    derivation_in_typst,
    typst_pdf,
    wants_wide_page,
)
from robostiff.errors import printable
from robostiff.markup import TYPST_BLOCKS, Bullets, Facts, Table, Tone, block_typst, typst_text
from robostiff.plot import Matplotlib, Width
from robostiff.report.contents import ReportContents
from robostiff.report.section import (
    Figure,
    Folded,
    FormulaBlock,
    Part,
    SideBySide,
    Verbatim,
    in_halves,
    report_title,
    verdict_of,
)
from robostiff.report.sections import report_sections
from robostiff.version import __version__

_LINES = "\n\t"
_ALONE = 50  # % of the width of the page, of a figure with none beside it
_Row = TypeVar("_Row")
_PREAMBLE = """\
#set document(title: {title}, date: none)
#set page(
  paper: "a4", margin: (x: 20mm, y: 15mm), numbering: "1 / 1",
  footer: context [
    #set text(size: 8pt, fill: luma(90))
    robostiff {version} #h(1fr) #counter(page).display("1 / 1", both: true)
  ],
)
#set text(size: 9pt)
#show table: set text(size: 8pt)
#set par(justify: false)
#show heading: set block(above: 1.3em, below: 0.8em, sticky: true)
#show figure: set block(above: 1.2em, below: 1.2em)
#show figure.caption: set text(size: 9pt)
#set figure(numbering: none)
"""


def report_pdf(contents: ReportContents) -> bytes:
    """A report as a PDF.

    Raises
    ------
    InputError
        When Typst or Matplotlib is missing.
    """
    return typst_pdf(report_typst(contents))


def report_typst(contents: ReportContents) -> str:
    """A report as the source of a Typst document; its figures are inside.

    Parameters
    ----------
    contents : ReportContents

    Raises
    ------
    InputError
        When Matplotlib is missing.
    """
    title = report_title(contents)
    preamble = _PREAMBLE.format(title=_quoted(title), version=typst_text(__version__))
    lead = verdict_of(contents)
    written = [
        preamble,
        TYPST_BLOCKS,
        TYPST_DERIVATIONS,
        f"#text(size: 16pt, weight: 700)[{typst_text(title)}]",
        *(block_typst(Facts(lines)) for lines in (contents.title_block.lines,) if lines),
        f"{typst_text(lead.place)}: status *{typst_text(str(lead.status))}*{lead.rank}.",
    ]
    if lead.advice:
        written.append(block_typst(Bullets(lead.advice, Tone.WARNING)))
    for section in report_sections(contents):
        written += [f"= {typst_text(section.title)}", *_parts(section.parts)]
    return "\n\n".join(written) + "\n"


def _parts(parts: Iterable[Part]) -> Iterator[str]:
    """Parts one after the other, two figures in a row side by side."""
    for is_figure, group in groupby(parts, lambda part: isinstance(part, Figure)):
        own = list(group)
        figures = [part for part in own if isinstance(part, Figure)]
        if not is_figure:
            yield from map(_part, own)
        elif len(figures) == 1:
            yield "#" + _figure(figures[0], _ALONE)
        else:
            yield _beside([_figure(figure) for figure in figures])


def _beside(cells: Sequence[str]) -> str:
    listed = ",\n".join(cells)
    return f"#grid(columns: (1fr, 1fr), column-gutter: 1.5em, row-gutter: 1em,\n{listed})"


def _halves(rows: Sequence[_Row]) -> tuple[Sequence[_Row], Sequence[_Row]]:
    middle = (len(rows) + 1) // 2
    return rows[:middle], rows[middle:]


def _part(part: Part) -> str:  # noqa: PLR0911
    match part:
        case Table(header, rows) if in_halves(part):
            halves = (Table(header, own) for own in _halves(rows))
            return _beside([f"[{block_typst(half)}]" for half in halves])
        case FormulaBlock(derivation):
            written = derivation_in_typst(derivation, first_heading=3)
            small = wants_wide_page(derivation)  # what is wider than the page still is scaled down
            return f"#[\n#set text(size: 7pt)\n{written}\n]" if small else written
        case Folded(title, parts):
            return "\n\n".join([f"== {typst_text(title)}", *_parts(parts)])
        case Verbatim(text):
            lines = printable(text, kept=_LINES).split("\n")
            halves = map(_quoted, map("\n".join, _halves(lines)))
            return _beside([f"text(size: 5.5pt, raw({half}, block: true))" for half in halves])
        case SideBySide(blocks) if all(isinstance(block, Table) for block in blocks):
            cells = ", ".join(f"[{block_typst(block)}]" for block in blocks)
            return f"#grid(columns: {len(blocks)}, column-gutter: 2em,\n{cells})"
        case SideBySide(blocks):
            return "\n\n".join(map(block_typst, blocks))
        case Figure():
            return "#" + _figure(part, _ALONE)
        case _:
            return block_typst(part)


def _figure(figure: Figure, share: int = 100) -> str:
    """The figure that the HTML page shows first, as wide as a share of its place [%]."""
    level = figure.levels[figure.start]
    caption = figure.caption + (f" Here {level.label}." if level.label else "")
    # half as wide as a page, so that its letters stay 8 points high
    source = _quoted(Matplotlib(width=Width.HALF).svg(level.picture))
    image = f'image(bytes({source}), format: "svg", width: {share}%)'
    return f"figure({image}, caption: [{typst_text(caption)}])"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
