"""A derivation in LaTeX, and in Markdown with LaTeX in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import sympy as sp
from sympy.printing.latex import LatexPrinter

from robostiff.analytic.export.blocks import (
    EquationRows,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
    Sentences,
    Title,
    Total,
)
from robostiff.analytic.export.entries import symbols_of
from robostiff.analytic.export.language import Language, Row
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.export.products import is_greek, is_word, number_in_front, ordered_terms
from robostiff.analytic.legs.leg_elimination import LegElimination
from robostiff.analytic.vectors.vector_expressions import Sum

# Letters of 10 pt that stand side by side in the text width of an article, and in Markdown.
_ROOM, _ROOM_OF_MARKDOWN = 58.0, 70.0
_ESCAPED = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "²": r"\textsuperscript{2}",
    **{character: f"\\{character}" for character in "#$%&_"},
}


_SLASH = re.compile(r"(?<=\w\w)/(?=\w)")  # of a name, not of a unit
_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|$~&!])")  # in Markdown


def latex_words(text: str) -> str:
    """Text for LaTeX, its special characters escaped."""
    return "".join(_ESCAPED.get(character, character) for character in " ".join(text.split()))


def derivation_latex(derivation: Any) -> str:
    r"""A derivation as a fragment of LaTeX, to be put into a document that loads amsmath.

    Entries for which a matrix has no room get a name; long sums are broken over several lines.

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> print("\n".join(derivation_latex(Derivation("K_C", K, (), K)).splitlines()[7:16]))
    \paragraph*{Result}
    <BLANKLINE>
    \[
    \mathbf{K}_{C} = \frac{k_{\tau}}{3} \begin{bmatrix}
    1 & 0 & 0 \\
    0 & 1 & 0 \\
    0 & 0 & 0
    \end{bmatrix}
    \]
    """
    written = LATEX.document(outline_of(derivation))
    start = "% needs \\usepackage{amsmath}\n\\begingroup\\allowdisplaybreaks\\sloppy\\parindent=0pt"
    return "\n\n".join([start, *written, "\\endgroup"]) + "\n"


def derivation_markdown(derivation: Any) -> str:
    r"""A derivation as Markdown, its formulas in ``$...$`` and ``$$...$$``.

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> derivation_markdown(Derivation("K_C", K, (), K)).splitlines()[4]
    '## Result'
    """
    return "\n\n".join(_Markdown(_ROOM_OF_MARKDOWN).document(outline_of(derivation))) + "\n"


def latex_snippet(derivation: Any) -> str:
    r"""The matrix and the names in it in LaTeX with nothing around it, to be put into an equation.

    Where K is a sum over a generic leg, the equations of this leg and the sum; of one leg its
    stiffness after the last joint. Several equations are an ``aligned`` environment of amsmath.

    Examples
    --------
    >>> from robostiff.analytic import Derivation
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> print(latex_snippet(Derivation("K_C", K, (), K)).splitlines()[0])
    \mathbf{K}_{C} = \frac{k_{\tau}}{3} \begin{bmatrix}
    """
    sections: list[list[Any]] = [[]]
    for block in outline_of(derivation):
        if isinstance(block, Title):
            sections.append([])
        elif not isinstance(block, Sentences | Nomenclature | FormulaTable):
            sections[-1].append(block)
    last = max(i for i, own in enumerate(sections) if any(map(_is_result, own)))
    blocks = sections[last]
    if isinstance(derivation, LegElimination):
        blocks = [b for b in blocks if isinstance(b, MatrixEquation) and not b.is_vector]
    if any(isinstance(b, MatrixEquation) for b in blocks):  # without its beginning w w^T / c
        blocks = [b for b in blocks if not (_is_result(b) and _totals(b) == [""])]
    before = [
        row for own in sections[:last] for b in own if isinstance(b, EquationRows) for row in b.rows
    ]
    wanted = symbols_of(x for b in blocks if isinstance(b, MatrixEquation) for x in b.whole)
    rows = [row.expression for b in blocks if isinstance(b, EquationRows) for row in b.rows]
    wanted |= symbols_of(x for x in rows if isinstance(x, sp.Expr))
    names = []
    for row in reversed(before):
        if row.name in {x.name for x in wanted} and isinstance(row.expression, sp.Expr):
            names.insert(0, row)
            wanted |= row.expression.free_symbols
    written = [EquationRows(tuple(names))] * bool(names) + blocks
    return "\n\n".join(LATEX.in_lines(x) for b in written for x in LATEX.formulas(b)) + "\n"


def _totals(block: Any) -> list[str]:
    """Indices of the sums that equations have: empty for sums over all of a kind."""
    each = [row.expression for row in block.rows] if isinstance(block, EquationRows) else []
    parts = [term for x in each for _, term in (x.terms if isinstance(x, Sum) else ((1, x),))]
    return [term.index for term in parts if isinstance(term, Total)]


def _is_result(block: Any) -> bool:
    return isinstance(block, MatrixEquation) or bool(_totals(block))


class _Latex(Language):
    """Matrices are bmatrix environments, equations below one another stand in align*."""

    opening, closing, slash, power = r"\bigl(", r"\bigr)", r"\big/", "^{{}}"
    fraction, partial, norm = r"\frac{{{}}}{{{}}}", "\\partial ", r"\lvert {} \rvert"
    cross, dot, apart, dots = r"\times", r"\cdot", r" \, ", r"\ldots"
    transposed, inverse = r"^{\mathsf{T}}", "^{-1}"
    total, total_over, below = r"\sum", r"\sum_{{{}}}", "_{{{}}}"
    matrix_signs = ("\\begin{bmatrix}\n", " & ", " \\\\\n", "\n\\end{bmatrix}")
    # Not a description: its labels are never broken over lines.
    _start = r"\begin{itemize}\itemsep=0pt\parsep=0pt"
    list_signs = ([_start], r"\item {}: {}", [r"\end{itemize}"])

    def write(self, expression: Any) -> str:
        symbols = expression.atoms(sp.Symbol)
        names = {s: self.name(s.name) for s in symbols}
        product = r"\," if any(is_word(s.name) for s in symbols) else None
        settings = {"symbol_names": names, "full_prec": False, "mul_symbol": product}
        return _LatexPrinter(settings).doprint(expression)

    def word(self, word: str) -> str:
        if word == "omicron":
            return "o"
        if is_greek(word):
            return f"\\{word}"
        if word.isascii() and ((len(word) == 1 and word.isalpha()) or word.isdigit()):
            return word
        kind = "mathrm" if word.isascii() and word.isalnum() else "text"
        return f"\\{kind}{{{latex_words(word)}}}"

    def bold(self, letter: str) -> str:
        return f"\\mathbf{{{latex_words(letter)}}}"

    def matrix(self, rows: list[list[str]]) -> str:
        written = super().matrix(rows)  # fractions do not meet
        return written.replace(" \\\\\n", " \\\\[4pt]\n") if "\\frac" in written else written

    def in_brackets(self, written: str) -> str:
        return _bracketed(written)

    def words(self, text: str) -> str:
        return _SLASH.sub(r"/\\allowbreak{}", latex_words(text))

    def heading(self, text: str, level: int) -> str:
        return f"\\{'subsection' if level == 1 else 'paragraph'}*{{{text}}}"

    def table(self, rows: list[list[str]]) -> str:
        head, *lines = map(" & ".join, rows)
        body = " \\\\\n".join(lines)
        before = "{\\medskip\\tabcolsep=3pt\\renewcommand{\\arraystretch}{1.4}"  # for fractions
        start = f"\\begin{{tabular}}{{{'l' * len(rows[0])}}}\n{head} \\\\\n\\hline"
        return f"{before}\n{start}\n{body}\n\\end{{tabular}}\\par\\medskip}}"

    def display(self, rows: Sequence[Row]) -> list[str]:
        written = self.in_lines(rows, "align*")
        return [written if written.startswith("\\begin") else f"\\[\n{written}\n\\]"]

    def in_lines(self, rows: Sequence[Row], environment: str = "aligned") -> str:
        """A short equation, or equations one below the other, aligned at their equals signs."""
        if len(rows) == 1 and len(rows[0].lines) == 1:
            return f"{rows[0].left} = {rows[0].lines[0]}"
        each = [f"{row.left} &= " + " \\\\\n&\\quad ".join(row.lines) for row in rows]
        body = " \\\\\n".join(each)
        return f"\\begin{{{environment}}}\n{body}\n\\end{{{environment}}}"


class _Markdown(_Latex):
    """Words in Markdown, formulas in LaTeX."""

    dots, list_signs = "…", ((), "- {}: {}", ())

    def words(self, text: str) -> str:
        return _SPECIAL.sub(r"\\\1", " ".join(text.split()))

    def heading(self, text: str, level: int) -> str:
        return f"{'#' * level} {text}"

    def table(self, rows: list[list[str]]) -> str:
        each = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
        return "\n".join(f"| {' | '.join(row)} |" for row in each)

    def display(self, rows: Sequence[Row]) -> list[str]:
        return [f"$$\n{self.in_lines(rows)}\n$$"]


class _LatexPrinter(LatexPrinter):
    """As SymPy writes it, a positive term first, and words apart from what is beside them."""

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        return ordered_terms(expr)

    def _print_Mul(self, expr: Any) -> str:
        number, rest = number_in_front(expr)
        if rest is None:
            return super()._print_Mul(expr)
        written = self._print(rest)
        return f"{self._print(number)} {_bracketed(written) if rest.is_Add else written}"


def _bracketed(written: str) -> str:
    is_high = any(command in written for command in ("\\frac", "\\sqrt", "\\sum"))
    return f"\\left({written}\\right)" if is_high else f"({written})"


#: Formulas in LaTeX.
LATEX: _Latex = _Latex(_ROOM)
