"""Derivations as documents: plain text, LaTeX, Markdown, HTML, Typst and PDF; and as data."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation, RobotDerivation
from robostiff.analytic.export.entries import EntryNames, readable_matrix, symbols_of
from robostiff.analytic.export.language import fit, math_width, room_beside
from robostiff.analytic.export.languages import (
    LATEX,
    MARKDOWN,
    MATHML,
    ROOM_ON_ITS_SIDE,
    ROOM_UPRIGHT,
    TEXT,
    TYPST,
)
from robostiff.analytic.export.notation import (
    Block,
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Meaning,
    Nomenclature,
    Sentences,
    Title,
    equation,
    is_value,
    own_axes,
    transport,
)
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.legs import LegElimination
from robostiff.errors import InputError, needs_extra, printable
from robostiff.markup import element, escaped

_NARROWEST = 60


def derivation_text(derivation: Any, width: int = 88) -> str:
    r"""A derivation as plain text: the start, each passive joint, the result.

    Parameters
    ----------
    derivation : Formula
    width : int
        Longest line. Longer expressions go on in the next line, indented; entries for which a
        matrix has no room get a name.

    Raises
    ------
    InputError
        When there is too little width for a matrix.
    """
    if width < _NARROWEST:
        raise InputError("width", got=width, expected=f"{_NARROWEST} characters or more")
    return "\n\n".join(TEXT.at(width).document(outline_of(derivation))) + "\n"


def derivation_latex(derivation: Any) -> str:
    """A derivation as a fragment of LaTeX, to be put into a document that loads amsmath.

    Entries for which a matrix has no room get a name; long sums are broken over several lines.
    """
    written = LATEX.document(outline_of(derivation))
    start = "% needs \\usepackage{amsmath}\n\\begingroup\\allowdisplaybreaks\\sloppy\\parindent=0pt"
    return "\n\n".join([start, *written, "\\endgroup"]) + "\n"


def derivation_markdown(derivation: Any) -> str:
    """A derivation as Markdown, its formulas in ``$...$`` and ``$$...$$``."""
    return "\n\n".join(MARKDOWN.document(outline_of(derivation))) + "\n"


def latex_snippet(derivation: Any) -> str:
    r"""The matrix and the names in it in LaTeX with nothing around it, to be put into an equation.

    Where K is a sum over a generic leg, the equations of this leg, the table of what differs
    between the legs, and the sum; of one leg its wrenches, or the compliance in its own axes.
    Several equations are an ``aligned`` environment of amsmath. Names that stand for numbers of the
    model are explained in comments before the formula.
    """
    sections: list[list[Any]] = [[]]
    meanings: tuple[Meaning, ...] = ()
    parts: list[int] = []  # where modules of a machine begin
    for block in outline_of(derivation):
        if isinstance(block, Title):
            parts += [len(sections)] * (block.level == 2)
            sections.append([])
        elif isinstance(block, Nomenclature):
            meanings = block.rows
        elif not isinstance(block, Sentences):
            sections[-1].append(block)

    def rows_of(*blocks: Any) -> list[Any]:
        return [row for b in blocks if isinstance(b, EquationRows) for row in b.rows]

    def totals(block: Any) -> list[str]:
        """Indices of the sums that equations have: empty for sums over all of a kind."""
        texts = " ".join(x.expression for x in rows_of(block) if isinstance(x.expression, str))
        return re.findall(r"sum (?:over (\w+) )?of", texts)

    is_leg = isinstance(derivation, LegElimination)
    machine = getattr(derivation, "in_series", derivation)  # of modules
    machine = machine if getattr(machine, "modules", ()) else None
    name = EntryNames(derivation).result

    def is_result(block: Any) -> bool:
        if is_leg or machine:
            return any(x.name == name for x in rows_of(block))
        return isinstance(block, MatrixEquation) or bool(totals(block))

    last = max(i for i, section in enumerate(sections) if any(map(is_result, section)))
    blocks = sections[last]
    if machine:
        each = pairwise([x for x in parts if x <= last] + [last + 1])
        blocks = [b for start, end in each for b in _from_matrix(sections[start:end])]
    comments: list[str] = []
    if is_leg and derivation.at_vector_level is None:
        blocks, comments = _in_own_axes(derivation, name), [_OF_W] * bool(derivation.stages)
    elif not machine and any(isinstance(b, MatrixEquation) for b in blocks):
        # Without its beginning w w^T / c.
        blocks = [b for b in blocks if totals(b) != [""] and not isinstance(b, FormulaTable)]
    wanted = symbols_of(x for b in blocks if isinstance(b, MatrixEquation) for x in b.whole)
    each = [row.expression for row in rows_of(*blocks)]
    wanted |= symbols_of(x for x in each if isinstance(x, sp.Expr))
    names, shown = list[Any](), {row.name for row in rows_of(*blocks)}
    for row in reversed(rows_of(*(b for section in sections[:last] for b in section))):
        is_wanted = row.name in {x.name for x in wanted} - shown
        if is_wanted and isinstance(row.expression, sp.Expr):
            names.insert(0, row)
            wanted |= row.expression.free_symbols
    definitions = (*derivation.as_printed[1], *(machine.names if machine else ()))
    numbers = {str(d.symbol) for d in definitions if is_value(d)}
    numbers &= {x.name for x in wanted}
    comments += [
        f"% {', '.join(map(str, symbols))}: {printable(words)}\n"
        for symbols, words in meanings
        if numbers & set(map(str, symbols))
    ]
    written = [EquationRows(tuple(names))] * bool(names) + blocks
    formulas: list[str] = []
    for block in written:
        if isinstance(block, FormulaTable):
            formulas.append(_table_in_formula(block))
        else:
            formulas += map(LATEX.in_lines, LATEX.formulas(block))
    return "".join(comments) + "\n\n".join(formulas) + "\n"


def _from_matrix(sections: list[list[Any]]) -> list[Any]:
    """Blocks of a module from its matrix on, or as they stand."""
    with_matrix = [any(isinstance(b, MatrixEquation) for b in x) for x in sections]
    first = with_matrix.index(True) if any(with_matrix) else 0
    return [b for x in sections[first:] for b in x]


_OF_W = "% J: twists of the passive joints; W: wrenches that do no work on them, J^T W = 0\n"


def _in_own_axes(leg: LegElimination, name: str) -> list[Block]:
    """The stiffness of a leg by its compliance in its own axes, and what brings it from there."""
    blocks: list[Block] = [MatrixEquation("C", readable_matrix(leg.C))]
    if leg.stages:
        J = sp.ImmutableMatrix.hstack(*(stage.J for stage in leg.stages))
        blocks.append(MatrixEquation("J", readable_matrix(J)))
    K = "W (W^T C W)^-1 W^T" if leg.stages else "C^-1"
    if leg.axes == sp.eye(3) and leg.arm.is_zero_matrix:
        return [*blocks, equation(name, K)]
    before = f"{name}_0"
    return [*blocks, equation(before, K), *own_axes(leg), transport(name, before)]


def _table_in_formula(table: FormulaTable) -> str:
    """A table as an ``array`` of LaTeX, which is a formula."""
    lines = []
    for words, formulas in ((table.of, table.head), *table.rows):
        each = (LATEX.name(x) if isinstance(x, str) else LATEX.written(x) for x in formulas)
        lines.append(" & ".join([f"\\text{{{LATEX.said(words)}}}", *each]))
    columns, (head, *rows) = "l" * (1 + len(table.head)), lines
    body = " \\\\[4pt]\n".join(rows)  # room between fractions, and below the line
    start = f"\\begin{{array}}{{{columns}}}\n{head} \\\\ \\hline \\rule{{0pt}}{{2.6ex}}"
    return f"{start}\n{body}\n\\end{{array}}"


_PAGE_STYLE = """\
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 serif; }
.formula { overflow-x: auto; padding: 0.35rem 0; }
mi.matrix { font-weight: bold; }
table { border-collapse: collapse; margin: 0.5rem 2rem; }
td, th { padding: 0.15rem 0.8rem; text-align: left; }
th { border-bottom: 1px solid; font-weight: normal; }
"""


def derivation_html(derivation: Any, *, first_heading: int = 1) -> str:
    """A derivation as a fragment of HTML, with formulas in MathML.

    `first_heading`: level of its title, 1 to 5.
    """
    return "\n".join(MATHML.at(first=first_heading).document(outline_of(derivation)))


def derivation_page(derivation: Any) -> str:
    """A derivation as a whole page of HTML."""
    head = (
        '<meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(_title(derivation))}</title><style>{_PAGE_STYLE}</style>"
    )
    body = element("body", derivation_html(derivation))
    return f'<!DOCTYPE html>\n<html lang="en">{element("head", head)}\n{body}\n</html>\n'


def _title(derivation: Any) -> str:
    title = next(block.text for block in outline_of(derivation) if isinstance(block, Title))
    return printable(title, kept="\n")


_PREAMBLE = """\
#set document(title: {title}, date: none)
#set page(paper: "a4", flipped: {flipped}, margin: (x: 20mm, y: 18mm), numbering: "1 / 1")
#set text(size: 10pt)
#set par(justify: false)
#show heading: set block(above: 1.5em, below: 0.9em, sticky: true)
"""

#: Definitions that a document of Typst needs before the first derivation.
TYPST_DERIVATIONS = """\
#set math.mat(column-gap: 1.1em, row-gap: 0.55em)
#show math.equation.where(block: true): set align(left)
#show math.equation.where(block: true): set block(breakable: true)

// Formulas wider than the page are scaled down.
#let fit(body) = block(inset: (left: 1.5em), layout(page => {
  let width = measure(body).width
  if width > page.width {
    scale(page.width / width * 100%, origin: left, reflow: true, body)
  } else { body }
}))

#let side-by-side(count, ..equations) = block(
  above: 1.4em, below: 1.4em, inset: (left: 1.5em), grid(
  columns: (1fr,) * count, row-gutter: 0.9em, align: horizon, ..equations,
))
"""


def derivation_typst(derivation: Any) -> str:
    """A derivation as the source of a Typst document."""
    flipped = "true" if wants_wide_page(derivation) else "false"
    preamble = _PREAMBLE.format(title=TYPST.quoted(_title(derivation)), flipped=flipped)
    return f"{preamble}\n{TYPST_DERIVATIONS}\n{derivation_in_typst(derivation)}"


def wants_wide_page(derivation: Any) -> bool:
    """Whether a matrix needs a landscape page, so that fewer of its entries have names."""
    blocks = (b for b in outline_of(derivation) if isinstance(b, MatrixEquation))
    return any(fit(b, math_width, room_beside(b, ROOM_UPRIGHT))[2].rows for b in blocks)


def derivation_in_typst(derivation: Any, *, first_heading: int = 1) -> str:
    """A derivation as a fragment of a Typst document that begins with `TYPST_DERIVATIONS`.

    `first_heading`: level of its title.
    """
    room = ROOM_ON_ITS_SIDE if wants_wide_page(derivation) else ROOM_UPRIGHT
    return "\n\n".join(TYPST.at(room, first_heading).document(outline_of(derivation))) + "\n"


def derivation_pdf(derivation: Any, path: str | Path) -> None:
    """Write a derivation as a PDF, to the file `path`.

    Raises
    ------
    InputError
        When the optional package typst is not installed: ``pip install 'robostiff[pdf]'``.
    """
    Path(path).write_bytes(typst_pdf(derivation_typst(derivation)))


def typst_pdf(source: str) -> bytes:
    """A Typst document as a PDF, with the fonts of Typst.

    Raises
    ------
    InputError
        When the optional package typst is not installed.
    """
    with needs_extra("PDF files", "pdf"):
        import typst
    return typst.compile(source.encode(), ignore_system_fonts=True, timestamp=0)


_SCHEMA = "robostiff derive 2"
_LEFT_OUT = {"at_vector_level", "general_rank", "steps_asked", "unit", "vectors"}


def derivation_data(derivation: Derivation) -> dict[str, Any]:
    """A derivation as plain data, ready for JSON.

    Expressions are text such as ``k*r**2/2``, which `robostiff.io.expression.parse` and SymPy read;
    columns are lists of them, matrices lists of rows.

    Parameters
    ----------
    derivation : Derivation
    """
    symbols = [x.name for x in derivation.symbols]
    return {"schema": _SCHEMA, "symbols": symbols, **_plain(derivation)}


def _plain(part: Any) -> Any:
    if isinstance(part, sp.MatrixBase):
        rows = [[_plain(x) for x in row] for row in part.tolist()]
        return [x for (x,) in rows] if part.cols == 1 else rows
    if isinstance(part, sp.Basic):
        return sp.sstr(part, full_prec=True)
    if isinstance(part, tuple):
        return [_plain(x) for x in part]
    if is_dataclass(part):
        left_out = _LEFT_OUT | ({"named"} if not isinstance(part, RobotDerivation) else set())
        names = [x.name for x in fields(part) if x.name not in left_out]
        return {name: _plain(getattr(part, name)) for name in names}
    return dict(part) if isinstance(part, Mapping) else part
