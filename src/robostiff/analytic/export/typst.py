"""A derivation in Typst, and as a PDF."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

from robostiff.analytic.export.blocks import MatrixEquation, Title
from robostiff.analytic.export.broken_lines import math_width
from robostiff.analytic.export.language import Language, Row, Typeset, fitted, room_beside
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.export.products import is_greek
from robostiff.analytic.export.vocabulary import function_name
from robostiff.errors import needs_extra
from robostiff.markup import typst_text

# Letters of 10 pt side by side in the text of A4 upright (planar) and on its side (spatial).
_ROOM_UPRIGHT = 84.0
_ROOM_ON_ITS_SIDE = 112.0
_BETWEEN_COLUMNS = 3.0

_PREAMBLE = """\
#set document(title: "{title}", date: none)
#set page(paper: "a4", flipped: {flipped}, margin: (x: 20mm, y: 18mm), numbering: "1 / 1")
#set text(size: 10pt)
#set par(justify: false)
#show heading: set block(above: 1.5em, below: 0.9em, sticky: true)
"""

#: Definitions that a document needs before the first derivation.
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
    r"""A derivation as the source of a Typst document.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> print("\n".join(derivation_typst(Derivation("K_C", K, (), K)).splitlines()[27:33]))
    == Result
    <BLANKLINE>
    #fit($ bold(upright(K))_(C) = frac(k_(tau), 3) mat(delim: "[",
      1, 0, 0;
      0, 1, 0;
      0, 0, 0) $)
    """
    title = next(block.text for block in outline_of(derivation) if isinstance(block, Title))
    quoted = title.replace("\\", "\\\\").replace('"', '\\"')
    flipped = "true" if wants_wide_page(derivation) else "false"
    preamble = _PREAMBLE.format(title=quoted, flipped=flipped)
    return f"{preamble}\n{TYPST_DERIVATIONS}\n{derivation_in_typst(derivation)}"


def wants_wide_page(derivation: Any) -> bool:
    """Whether a matrix needs a landscape page, so that fewer of its entries have names."""
    blocks = (b for b in outline_of(derivation) if isinstance(b, MatrixEquation))
    return any(fitted(b, math_width, room_beside(b, _ROOM_UPRIGHT))[2].rows for b in blocks)


def derivation_in_typst(derivation: Any, *, first_heading: int = 1) -> str:
    """A derivation as a fragment of a Typst document that begins with `TYPST_DERIVATIONS`.

    `first_heading`: level of its title.
    """
    room = _ROOM_ON_ITS_SIDE if wants_wide_page(derivation) else _ROOM_UPRIGHT
    blocks = outline_of(derivation)
    return "\n\n".join(_Typst(room, first_heading).document(blocks)) + "\n"


def derivation_pdf(derivation: Any, path: str | Path) -> None:
    """Write a derivation as a PDF.

    Parameters
    ----------
    derivation : Formula
    path : str or Path
        The file to write.

    Raises
    ------
    InputError
        When the optional package typst is not installed.

    Examples
    --------
    The optional package comes with ``pip install 'robostiff[pdf]'``::

        derivation_pdf(derive_chain(K0, joints), "leg.pdf")
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


def _large(cell: str) -> str:
    """A cell with its fractions as large as those of an equation."""
    return f"display({cell})" if "frac(" in cell else cell


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


class _Typst(Typeset):
    """Expressions of the vocabulary, and other functions by their name."""

    printmethod = "_typst"
    functions: ClassVar[dict[str, str]] = {
        "acos": "arccos",
        "asin": "arcsin",
        "atan": "arctan",
        "atan2": 'op("atan2")',
        "log": "ln",
    }
    constants: ClassVar[dict[str, str]] = {"pi": "pi", "e": "upright(e)"}
    scientific = "{} dot 10^({})"
    opening, closing, slash, power = r"\(", r"\)", r"\/", "^({})"
    fraction, root, in_a_line, raised = "frac({}, {})", "sqrt({})", r"{}\/{}", "{}^({})"
    partial, norm, cross, dot, apart = "partial ", "abs({})", "times", "dot", " thin "
    below, matrix_signs = "_({})", ('mat(delim: "[",\n  ', ", ", ";\n  ", ")")
    _shape = "columns: (16%, 1fr), stroke: none, inset: (x: 0pt, y: 3pt), column-gutter: 1em,"
    list_signs = ([f"#table({_shape}"], "  [{}], [{}],", [")"])
    transposed, inverse, total, total_over = "^sans(upright(T))", "^(-1)", "sum", "sum_{}"

    def listed(self, rows: Sequence[tuple[str, str]]) -> str:
        found = super().listed(rows)
        return f"#columns(2)[\n{found}\n]" if self.room == _ROOM_ON_ITS_SIDE else found

    def word(self, word: str) -> str:
        is_bare = is_greek(word) or word.isdigit() or (len(word) == 1 and word.isalpha())
        return word if is_bare else _quoted(word)

    def bold(self, letter: str) -> str:
        return f"bold(upright({self.word(letter)}))"

    def words(self, text: str) -> str:
        return typst_text(text)

    def matrix(self, rows: list[list[str]]) -> str:
        return super().matrix([[_large(x) for x in row] for row in rows])

    def heading(self, text: str, level: int) -> str:
        return f"{'=' * (self.first + level - 1)} {text}"

    def table(self, rows: list[list[str]]) -> str:
        each = [[f"${_large(x[1:-1])}$" if x[:1] == "$" else x for x in row] for row in rows]
        cells = [f"  {' '.join(f'[{cell}],' for cell in row)}" for row in each]
        cells.insert(1, "  table.hline(stroke: 0.5pt),")
        shape = f"columns: {len(rows[0])}, stroke: none, column-gutter: 1em,"
        return "\n".join([f"#pad(left: 1.5em, table({shape}", *cells, "))"])

    def display(self, rows: Sequence[Row]) -> list[str]:
        """Short equations side by side; others in blocks of their own, which pages can break."""
        found = []
        for is_narrow, group in groupby(
            rows, lambda x: 2 * (x.width + _BETWEEN_COLUMNS) <= self.room
        ):
            own = list(group)
            written = [f"$ {_equation(row)} $" for row in own]
            if is_narrow and len(own) > 1:
                columns = int(self.room / (max(x.width for x in own) + _BETWEEN_COLUMNS))
                cells = "\n".join(f"  {x}," for x in written)
                found.append(f"#side-by-side({columns},\n{cells}\n)")
            else:
                found += [f"#fit({x})" for x in written]
        return found

    def applied(self, function: Any, power: str = "") -> str:
        arguments = ", ".join(self._print(argument) for argument in function.args)
        name = function_name(function)
        written = self.functions.get(name, name) if name else f"op({_quoted(str(function.func))})"
        if power:
            return f"{written}^{power} ({arguments})"
        return f"{written}{' ' if written.startswith('op(') else ''}({arguments})"

    def times(self, factor: str, *, apart: bool) -> str:
        if factor[0].isdigit():
            return " dot "
        return self.apart if apart else " "


def _equation(row: Row) -> str:
    if len(row.lines) == 1:
        return f"{row.left} = {row.lines[0]}"
    first, *others = row.lines
    return " \\\n  ".join([f"{row.left} = & {first}", *(f'& quad "" {line}' for line in others)])


#: Formulas in Typst.
TYPST: Language = _Typst(_ROOM_UPRIGHT)
