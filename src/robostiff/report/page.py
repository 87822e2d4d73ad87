"""The sections of a report as one self-contained HTML page."""

from __future__ import annotations

import gzip
import re
from base64 import b85encode
from functools import cache
from importlib.resources import files
from string import Template

from robostiff.analytic.export import derivation_html
from robostiff.errors import needs_extra
from robostiff.markup import (
    Bullets,
    Facts,
    LabelledMatrix,
    Table,
    Tone,
    block_html,
    element,
    escaped,
)
from robostiff.plot.on_plotly.swinging import swinging_script
from robostiff.report.contents import ReportContents
from robostiff.report.section import (
    Figure,
    Folded,
    FormulaBlock,
    Part,
    Section,
    SideBySide,
    Verbatim,
    figures_json,
    in_halves,
    report_title,
    verdict_of,
)
from robostiff.report.sections import report_sections
from robostiff.version import __version__


def report_html(contents: ReportContents) -> str:
    """A report as one HTML page that contains its style, script and figures.

    Parameters
    ----------
    contents : ReportContents

    Raises
    ------
    InputError
        When Plotly or Matplotlib is missing.
    """
    plotly = _packed_plotly()
    sections = report_sections(contents)
    links = (
        element("a", escaped(section.title), href=f"#{section.anchor}") for section in sections
    )
    return Template(_resource("page.html")).substitute(
        title=escaped(report_title(contents)),
        lead=_lead(contents),
        version=__version__,
        links="\n".join(links),
        sections="\n".join(map(_section_html, sections)),
        figures=packed(
            figures_json([figure for section in sections for figure in section.figures])
        ),
        style=_resource("page.css"),
        script=swinging_script() + _resource("page.js"),
        plotly=plotly,
    )


def _lead(contents: ReportContents) -> str:
    """The title block where it is given, then status and advice."""
    lines, verdict = contents.title_block.lines, verdict_of(contents)
    block = element("div", block_html(Facts(lines)), class_="title-block") if lines else ""
    word = element("span", escaped(verdict.status), class_=f"status-{verdict.kind}")
    lead = element("p", f"{escaped(verdict.place)}: status {word}{verdict.rank}.", class_="lead")
    return block + lead + block_html(Bullets(verdict.advice, Tone.WARNING))


def _section_html(section: Section) -> str:
    heading = element("h2", escaped(section.title))
    return element(
        "section", "\n".join([heading, *map(_part_html, section.parts)]), id=section.anchor
    )


def _part_html(part: Part) -> str:
    match part:
        case Figure():
            return _figure_html(part)
        case FormulaBlock(derivation):
            return derivation_html(derivation, first_heading=3)
        case Folded(title, parts):
            inner = "\n".join(map(_part_html, parts))
            return element("details", element("summary", escaped(title)) + inner)
        case Verbatim(text):
            return element("pre", escaped(text))
        case SideBySide(blocks):
            inner = "".join(element("div", block_html(block)) for block in blocks)
            return element("div", inner, class_="side-by-side")
        case _:
            html = block_html(part)
            kind = "wide long" if isinstance(part, Table) and in_halves(part) else "wide"
            is_wide = isinstance(part, Table | LabelledMatrix)
            return element("div", html, class_=kind) if is_wide else html


def _figure_html(figure: Figure) -> str:
    """The element in which the script draws the figure, with its slider below."""
    caption, name, start = escaped(figure.caption), figure.name, figure.start
    kind = "plot" if figure.is_scene else "chart"
    parts = [element("div", "", class_=kind, id=f"plot-{name}")]
    if figure.is_scene:
        parts.append(f'<img class="on-paper" id="print-{name}" alt="{caption}">')
    if len(figure.levels) > 1:
        slider = (
            f'<input type="range" min="0" max="{len(figure.levels) - 1}" value="{start}" '
            f'id="slider-{name}" aria-label="{caption}">'
        )
        label = escaped(figure.levels[start].label)
        output = element("output", label, id=f"label-{name}", for_=f"slider-{name}")
        parts.append(element("div", slider + output, class_="slider"))
    parts.append(element("figcaption", caption))
    return element("figure", "".join(parts))


# the program that draws tiles of street maps, a tenth of Plotly, which no figure of a report has
_STREET_MAPS = re.compile(r"\bexports='(?=(?:[^'\\]|\\.){100000})(?:[^'\\]|\\.)*'")


@cache
def _packed_plotly() -> str:
    with needs_extra("plots", "plot"):
        from plotly.offline import get_plotlyjs
    return packed(_STREET_MAPS.sub("exports=''", get_plotlyjs()))


# RFC 1924, with a full stop in place of the one character that could begin a tag
_HTML = bytes.maketrans(b"<", b".")


def packed(text: str) -> str:
    """Text as the script of the page unpacks it: compressed, in characters that HTML leaves alone.

    The same text is packed in the same way each time.
    """
    compressed = gzip.compress(text.encode(), 9, mtime=0)
    return b85encode(compressed).translate(_HTML).decode("ascii")


def _resource(name: str) -> str:
    return files("robostiff.report").joinpath(name).read_text(encoding="utf-8")
