"""The sections of a report as a Typst document, and as a PDF."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from io import StringIO
from typing import Any

from robostiff.analytic.export.typst import (
    TYPST_DERIVATIONS,
    derivation_in_typst,
    typst_pdf,
    wants_wide_page,
)
from robostiff.errors import needs_extra, printable
from robostiff.markup import TYPST_BLOCKS, Bullets, Facts, Tone, block_typst, typst_text
from robostiff.plot import Matplotlib
from robostiff.plot.picture import Picture
from robostiff.report.contents import ReportContents
from robostiff.report.figures import Figure
from robostiff.report.section import (
    Folded,
    FormulaBlock,
    Part,
    Section,
    SideBySide,
    Verbatim,
    report_title,
    verdict_of,
)
from robostiff.report.sections import report_sections
from robostiff.version import __version__

_LINES = "\n\t"
_PREAMBLE = """\
#set document(title: {title}, date: none)
#set page(
  paper: "a4", margin: (x: 20mm, y: 18mm), numbering: "1 / 1",
  footer: context [
    #set text(size: 8pt, fill: luma(90))
    robostiff {version} #h(1fr) #counter(page).display("1 / 1", both: true)
  ],
)
#set text(size: 9.5pt)
#show table: set text(size: 8pt)
#set par(justify: false)
#show heading: set block(above: 1.5em, below: 0.9em, sticky: true)
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
    written += [_section(section) for section in report_sections(contents)]
    return "\n\n".join(written) + "\n"


def _section(section: Section) -> str:
    """A section; on landscape pages of its own if its matrices are wide."""
    written = "\n\n".join([f"= {typst_text(section.title)}", *map(_part, section.parts)])
    is_wide = any(wants_wide_page(formula.derivation) for formula in _formulas(section.parts))
    return f"#page(flipped: true)[\n{written}\n]" if is_wide else written


def _formulas(parts: Iterable[Part]) -> Iterator[FormulaBlock]:
    for part in parts:
        if isinstance(part, FormulaBlock):
            yield part
        elif isinstance(part, Folded):
            yield from _formulas(part.parts)


def _part(part: Part) -> str:
    match part:
        case Figure():
            return _figure(part)
        case FormulaBlock(derivation):
            return derivation_in_typst(derivation, first_heading=3)
        case Folded(title, parts):
            return "\n\n".join([f"== {typst_text(title)}", *map(_part, parts)])
        case Verbatim(text):
            lines = _quoted(printable(text, kept=_LINES))
            return f"#columns(2, text(size: 5.5pt, raw({lines}, block: true)))"
        case SideBySide(blocks):
            return "\n\n".join(map(block_typst, blocks))
        case _:
            return block_typst(part)


def _figure(figure: Figure) -> str:
    """The figure that the HTML page shows first."""
    level = figure.levels[figure.start]
    caption = figure.caption + (f" Here {level.label}." if level.label else "")
    image = f'image(bytes({_quoted(_svg(level.picture))}), format: "svg", width: 68%)'
    return f"#figure({image}, caption: [{typst_text(caption)}])"


def _svg(picture: Picture) -> str:
    with needs_extra("plots", "plot"):
        import matplotlib as mpl
    figure: Any = Matplotlib().draw(picture).figure
    written = StringIO()
    # deterministic names of clips
    with mpl.rc_context({"svg.hashsalt": "robostiff"}):
        figure.savefig(written, format="svg", metadata={"Date": None})
    return written.getvalue()


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
