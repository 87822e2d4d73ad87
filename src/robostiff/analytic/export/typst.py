"""A derivation, its expressions and matrices in Typst, and as a PDF."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import Breaks
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import (
    Display,
    MathLanguage,
    Row,
    displays,
    listed_names,
    sentences,
    table_cells,
)
from robostiff.analytic.export.entries import MatrixName
from robostiff.analytic.export.outline import (
    Block,
    FormulaTable,
    Nomenclature,
    OutlineHeading,
    OutlineText,
)
from robostiff.analytic.export.products import (
    FormulaPrinter,
    differential_parts,
    is_greek,
    name_parts,
)
from robostiff.analytic.export.vocabulary import constant_name, function_name
from robostiff.errors import needs_extra
from robostiff.markup import typst_text

_FUNCTIONS = {
    "acos": "arccos",
    "asin": "arcsin",
    "atan": "arctan",
    "atan2": 'op("atan2")',
    "log": "ln",
}


def typst_name(name: str) -> str:
    """Name of a symbol with its subscripts, in mathematics.

    Examples
    --------
    >>> [typst_name(name) for name in ("K_11", "mu_1", "u_1_3", "k_tau", "L_tip")]
    ['K_(11)', 'mu_(1)', 'u_(1,3)', 'k_(tau)', 'L_("tip")']
    """
    differential = differential_parts(name)
    if differential is not None:
        return f"frac(partial {typst_name(differential[0])}, partial {typst_name(differential[1])})"
    parts = name_parts(name)
    written = _word(parts.letter) + "'" * parts.primes
    if parts.subscripts:
        written += "_(" + ",".join(map(_word, parts.subscripts)) + ")"
    return written


def typst_matrix_name(name: str) -> str:
    """Name of a matrix or vector, in bold type."""
    differential = differential_parts(name)
    if differential is not None:
        above = f"partial {typst_matrix_name(differential[0])}"
        return f"frac({above}, partial {typst_name(differential[1])})"
    letter, *subscripts = typst_name(name).split("_", 1)
    bare = letter.rstrip("'")
    primes = letter[len(bare) :]
    return "_".join([f"bold(upright({bare})){primes}", *subscripts])


def typst_expression(expression: sp.Expr) -> str:
    """An expression in Typst."""
    return _TypstPrinter().doprint(expression)


def _word(word: str) -> str:
    if is_greek(word) or word.isdigit() or (len(word) == 1 and word.isalpha()):
        return word
    return _quoted(word)


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _matrix(rows: list[list[str]]) -> str:
    body = ";\n  ".join(", ".join(row) for row in rows)
    return f'mat(delim: "[",\n  {body})'


class _TypstPrinter(FormulaPrinter):
    """Expressions of the vocabulary, and other functions by their name."""

    printmethod = "_typst"
    fraction, root, in_a_line = "frac({}, {})", "sqrt({})", r"{}\/{}"
    raised, brackets = "{}^({})", "({})"

    def emptyPrinter(self, expr: sp.Basic) -> str:
        return self.applied(expr) if expr.args else _quoted(str(expr))

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return typst_name(expr.name)

    def _print_Integer(self, expr: sp.Integer) -> str:
        return str(expr)

    def _print_Float(self, expr: sp.Float) -> str:
        mantissa, _, exponent = sp.sstr(expr, full_prec=False).partition("e")
        return f"{mantissa} dot 10^({exponent})" if exponent else mantissa

    def _print_NumberSymbol(self, expr: sp.NumberSymbol) -> str:
        return {"pi": "pi", "e": "upright(e)"}.get(constant_name(expr) or "", _quoted(str(expr)))

    def applied(self, function: sp.Basic, power: str = "") -> str:
        arguments = ", ".join(self._print(argument) for argument in function.args)
        name = function_name(function)
        written = _FUNCTIONS.get(name, name) if name else f"op({_quoted(str(function.func))})"
        if power:
            return f"{written}^{power} ({arguments})"
        return f"{written}{' ' if written.startswith('op(') else ''}({arguments})"

    def times(self, factor: str, *, apart: bool) -> str:
        if factor[0].isdigit():
            return " dot "
        return " thin " if apart else " "


TYPST = MathLanguage(
    breaks=Breaks(typst_expression, r"\(", r"\)", r"\/", "^({})"),
    name=typst_name,
    matrix_name=typst_matrix_name,
    matrix=_matrix,
    fraction=_TypstPrinter.fraction.format,
    transposed="^sans(upright(T))",
    total="sum",
    inverse="^(-1)",
    times="times",
    apart=" thin ",
    number=str,
    dot="dot",
    norm=lambda written: f"abs({written})",
    total_over=lambda index: f"sum_{index}",
    inline=lambda formula: f"${formula}$",
    brackets="({})".format,
)


# Letters of 10 pt side by side in the text of A4 upright (planar) and on its side (spatial).
_ROOM_UPRIGHT = 72.0
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


def derivation_typst(derivation: Derivation | FormulaDerivative) -> str:
    r"""A derivation as the source of a Typst document.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative

    Examples
    --------
    >>> import sympy as sp
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
    title = next(
        block.text for block in outline_of(derivation) if isinstance(block, OutlineHeading)
    )
    quoted = title.replace("\\", "\\\\").replace('"', '\\"')
    flipped = "true" if wants_wide_page(derivation) else "false"
    preamble = _PREAMBLE.format(title=quoted, flipped=flipped)
    return f"{preamble}\n{TYPST_DERIVATIONS}\n{derivation_in_typst(derivation)}"


def wants_wide_page(derivation: Derivation | FormulaDerivative) -> bool:
    """Whether its matrices need a landscape page: 6 x 6 matrices do, planar ones do not."""
    return derivation.K.rows > 3


def derivation_in_typst(
    derivation: Derivation | FormulaDerivative, *, first_heading: int = 1
) -> str:
    """A derivation as a fragment of a Typst document that begins with `TYPST_DERIVATIONS`.

    `first_heading`: level of its title.
    """
    room = _ROOM_ON_ITS_SIDE if wants_wide_page(derivation) else _ROOM_UPRIGHT
    blocks = outline_of(derivation)
    written = [text for block in blocks for text in _written(block, room, first_heading)]
    return "\n\n".join(written) + "\n"


def derivation_pdf(derivation: Derivation | FormulaDerivative, path: str | Path) -> None:
    """Write a derivation as a PDF.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
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


def _written(block: Block, room: float, first: int) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            return [f"{'=' * (first + level - 1)} {typst_text(text)}"]
        case OutlineText():
            return [sentences(block, TYPST, typst_text)]
        case Nomenclature(rows):
            return [f"{'=' * (first + 1)} Nomenclature", _nomenclature(rows)]
        case FormulaTable():
            return [_table(block)]
        case _:
            formulas = displays(block, TYPST, room)
            return [text for formula in formulas for text in _placed(formula, room)]


def _table(table: FormulaTable) -> str:
    cells = [[typst_text(words), *own] for words, *own in table_cells(table, TYPST)]
    rows = [f"  {' '.join(f'[{cell}],' for cell in row)}" for row in cells]
    rows.insert(1, "  table.hline(stroke: 0.5pt),")
    shape = f"columns: {len(cells[0])}, stroke: none, column-gutter: 1em,"
    return "\n".join([f"#pad(left: 1.5em, table({shape}", *rows, "))"])


def _placed(formula: Display, room: float) -> list[str]:
    """Short equations side by side; others in blocks of their own, which pages can break."""
    found = []
    for is_narrow, group in groupby(formula, lambda x: 2 * (x.width + _BETWEEN_COLUMNS) <= room):
        rows = list(group)
        if is_narrow and len(rows) > 1:
            columns = int(room / (max(x.width for x in rows) + _BETWEEN_COLUMNS))
            cells = "\n".join(f"  $ {_equation(row)} $," for row in rows)
            found.append(f"#side-by-side({columns},\n{cells}\n)")
        else:
            found += [f"#fit($ {_equation(row)} $)" for row in rows]
    return found


def _equation(row: Row) -> str:
    if len(row.lines) == 1:
        return f"{row.left} = {row.lines[0]}"
    first, *others = row.lines
    return " \\\n  ".join([f"{row.left} = & {first}", *(f'& quad "" {line}' for line in others)])


def _nomenclature(rows: Sequence[tuple[tuple[MatrixName | str, ...], str]]) -> str:
    cells = [
        f"  [{listed_names(names, TYPST)}], [{typst_text(meaning)}]," for names, meaning in rows
    ]
    start = "#table(columns: (16%, 1fr), stroke: none, inset: (x: 0pt, y: 3pt), column-gutter: 1em,"
    return "\n".join([start, *cells, ")"])
