"""A derivation, its expressions and matrices in LaTeX, and in Markdown with LaTeX in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import Any

import sympy as sp
from sympy.printing.latex import LatexPrinter

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import Breaks
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import (
    Display,
    MathLanguage,
    displays,
    listed_names,
    sentences,
    table_cells,
)
from robostiff.analytic.export.entries import MatrixName, symbols_of
from robostiff.analytic.export.outline import (
    Block,
    FormulaTable,
    LegSum,
    MatrixEquation,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    Recursion,
    ScalarEquations,
    SpringSum,
    WrenchSum,
)
from robostiff.analytic.export.products import (
    differential_parts,
    is_greek,
    is_word,
    name_parts,
    number_in_front,
    ordered_terms,
)
from robostiff.analytic.legs.leg_elimination import LegElimination

_ESCAPED = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "²": r"\textsuperscript{2}",
    **{character: f"\\{character}" for character in "#$%&_"},
}


def latex_words(text: str) -> str:
    """Text for LaTeX, its special characters escaped."""
    return "".join(_ESCAPED.get(character, character) for character in " ".join(text.split()))


def latex_name(name: str, *, bold: bool = False) -> str:
    r"""Name of a symbol with its subscripts; of a matrix or vector in bold type.

    Examples
    --------
    >>> [latex_name(name) for name in ("K_11", "mu_1", "u_1_3", "k_tau", "L'_tip")]
    ['K_{11}', '\\mu_{1}', 'u_{1,3}', 'k_{\\tau}', "L'_{\\mathrm{tip}}"]
    >>> latex_name("dmu_1_dR")
    '\\frac{\\partial \\mu_{1}}{\\partial R}'
    """
    differential = differential_parts(name)
    if differential is not None:
        inner, by = differential
        above = f"\\partial {latex_name(inner, bold=bold)}"
        return f"\\frac{{{above}}}{{\\partial {latex_name(by)}}}"
    parts = name_parts(name)
    letter = f"\\mathbf{{{latex_words(parts.letter)}}}" if bold else _word(parts.letter)
    written = letter + "'" * parts.primes
    if parts.subscripts:
        written += "_{" + ",".join(map(_word, parts.subscripts)) + "}"
    return written


def latex_expression(expression: sp.Expr) -> str:
    """An expression in LaTeX."""
    symbols = expression.atoms(sp.Symbol)
    names = {s: latex_name(s.name) for s in symbols}
    product = r"\," if any(is_word(s.name) for s in symbols) else None
    settings = {"symbol_names": names, "full_prec": False, "mul_symbol": product}
    return _LatexPrinter(settings).doprint(expression)


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


def _word(word: str) -> str:
    if word == "omicron":
        return "o"
    if is_greek(word):
        return f"\\{word}"
    if word.isascii() and ((len(word) == 1 and word.isalpha()) or word.isdigit()):
        return word
    return f"\\{'mathrm' if word.isascii() and word.isalnum() else 'text'}{{{latex_words(word)}}}"


def _matrix(rows: list[list[str]]) -> str:
    lines = [" & ".join(row) for row in rows]
    apart = "[4pt]" if any("\\frac" in line for line in lines) else ""  # fractions do not meet
    body = f" \\\\{apart}\n".join(lines)
    return f"\\begin{{bmatrix}}\n{body}\n\\end{{bmatrix}}"


def _bracketed(written: str) -> str:
    is_high = any(command in written for command in ("\\frac", "\\sqrt", "\\sum"))
    return f"\\left({written}\\right)" if is_high else f"({written})"


LATEX = MathLanguage(
    breaks=Breaks(latex_expression, r"\bigl(", r"\bigr)", r"\big/", "^{{}}"),
    name=latex_name,
    matrix_name=partial(latex_name, bold=True),
    matrix=_matrix,
    fraction=lambda above, below: f"\\frac{{{above}}}{{{below}}}",
    transposed=r"^{\mathsf{T}}",
    total="\\sum",
    inverse=r"^{-1}",
    times=r"\times",
    apart=r" \, ",
    number=str,
    dot=r"\cdot",
    norm=lambda written: f"\\lvert {written} \\rvert",
    total_over=lambda index: rf"\sum_{{{index}}}",
    inline=lambda formula: f"${formula}$",
    brackets=_bracketed,
)


# Letters of 10 pt that stand side by side in the text width of an article.
_ROOM = 58.0


def derivation_latex(derivation: Derivation | FormulaDerivative) -> str:
    r"""A derivation as a fragment of LaTeX, to be put into a document that loads amsmath.

    Matrices are bmatrix environments, named intermediates stand in align*. Entries for which a
    matrix has no room get a name; long sums are broken over several lines.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative

    Examples
    --------
    >>> import sympy as sp
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
    written = [text for block in outline_of(derivation) for text in _written(block)]
    start = "% needs \\usepackage{amsmath}\n\\begingroup\\allowdisplaybreaks\\sloppy\\parindent=0pt"
    return "\n\n".join([start, *written, "\\endgroup"]) + "\n"


def _written(block: Block) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            command = "subsection" if level == 1 else "paragraph"
            return [f"\\{command}*{{{latex_words(text)}}}"]
        case OutlineText():
            return [
                sentences(block, LATEX, lambda x: latex_words(x).replace("/", "/\\allowbreak{}"))
            ]
        case Nomenclature(rows):
            return ["\\paragraph*{Nomenclature}", _nomenclature(rows)]
        case FormulaTable():
            return [_table(block)]
        case _:
            return [_display(formula) for formula in displays(block, LATEX, _ROOM)]


def _table(table: FormulaTable) -> str:
    cells = table_cells(table, LATEX)
    head, *lines = [" & ".join([latex_words(words), *own]) for words, *own in cells]
    body = " \\\\\n".join(lines)
    columns = "l" * len(cells[0])
    before = "{\\medskip\\tabcolsep=3pt\\renewcommand{\\arraystretch}{1.4}"  # fractions do not meet
    start = f"\\begin{{tabular}}{{{columns}}}\n{head} \\\\\n\\hline"
    return f"{before}\n{start}\n{body}\n\\end{{tabular}}\\par\\medskip}}"


def _display(formula: Display) -> str:
    written = _in_lines(formula, "align*")
    return written if written.startswith("\\begin") else f"\\[\n{written}\n\\]"


def _in_lines(formula: Display, environment: str = "aligned") -> str:
    """A short equation, or equations one below the other, aligned at their equals signs."""
    if len(formula) == 1 and len(formula[0].lines) == 1:
        return f"{formula[0].left} = {formula[0].lines[0]}"
    rows = [f"{row.left} &= " + " \\\\\n&\\quad ".join(row.lines) for row in formula]
    body = " \\\\\n".join(rows)
    return f"\\begin{{{environment}}}\n{body}\n\\end{{{environment}}}"


def _nomenclature(rows: Sequence[tuple[tuple[MatrixName | str, ...], str]]) -> str:
    # Not a description: its labels are never broken over lines.
    dots = "\\ldots"
    items = [
        f"\\item {listed_names(names, LATEX, dots)}: {latex_words(meaning)}"
        for names, meaning in rows
    ]
    return "\n".join(["\\begin{itemize}\\itemsep=0pt\\parsep=0pt", *items, "\\end{itemize}"])


def latex_snippet(derivation: Any) -> str:
    r"""The matrix and the names in it in LaTeX with nothing around it, to be put into an equation.

    Where K is a sum over a generic leg, the equations of this leg and the sum; of one leg its
    stiffness after the last joint. Several equations are an ``aligned`` environment of amsmath.

    Examples
    --------
    >>> import sympy as sp
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> print(latex_snippet(Derivation("K_C", K, (), K)).splitlines()[0])
    \mathbf{K}_{C} = \frac{k_{\tau}}{3} \begin{bmatrix}
    """
    sections: list[list[Any]] = [[]]
    for block in outline_of(derivation):
        if isinstance(block, OutlineHeading):
            sections.append([])
        elif not isinstance(block, OutlineText | Nomenclature | FormulaTable):
            sections[-1].append(block)
    sums = (MatrixEquation, LegSum, SpringSum)
    last = max(i for i, own in enumerate(sections) if any(isinstance(b, sums) for b in own))
    blocks = [b for b in sections[last] if not isinstance(b, WrenchSum | Recursion)]
    if isinstance(derivation, LegElimination):
        blocks = [b for b in blocks if isinstance(b, MatrixEquation) and not b.is_vector]
    before = [b for own in sections[:last] for b in own if isinstance(b, ScalarEquations)]
    wanted = symbols_of(x for b in blocks if isinstance(b, MatrixEquation) for x in b.whole)
    wanted |= symbols_of(x for b in blocks if isinstance(b, ScalarEquations) for _, x in b.rows)
    names = []
    for name, expression in reversed([row for b in before for row in b.rows]):
        if name in {x.name for x in wanted}:
            names.insert(0, (name, expression))
            wanted |= expression.free_symbols
    if names:
        blocks = [ScalarEquations(tuple(names)), *blocks]
    written = [_in_lines(x) for block in blocks for x in displays(block, LATEX, _ROOM)]
    return "\n\n".join(written) + "\n"


_MARKDOWN_ROOM = 70.0
_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|$~&!])")


def derivation_markdown(derivation: Derivation | FormulaDerivative) -> str:
    r"""A derivation as Markdown, its formulas in ``$...$`` and ``$$...$$``.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative

    Examples
    --------
    >>> import sympy as sp
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k / 3, k / 3, 0))
    >>> derivation_markdown(Derivation("K_C", K, (), K)).splitlines()[4]
    '## Result'
    """
    written = [text for block in outline_of(derivation) for text in _in_markdown(block)]
    return "\n\n".join(written) + "\n"


def _in_markdown(block: Block) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            return [f"{'#' * level} {_escaped(text)}"]
        case OutlineText():
            return [sentences(block, LATEX, _escaped)]
        case Nomenclature(rows):
            items = [
                f"- {listed_names(names, LATEX)}: {_escaped(meaning)}" for names, meaning in rows
            ]
            return ["## Nomenclature", "\n".join(items)]
        case FormulaTable():
            cells = [[_escaped(words), *own] for words, *own in table_cells(block, LATEX)]
            cells.insert(1, ["---"] * len(cells[0]))
            return ["\n".join(f"| {' | '.join(row)} |" for row in cells)]
        case _:
            return [f"$$\n{_in_lines(x)}\n$$" for x in displays(block, LATEX, _MARKDOWN_ROOM)]


def _escaped(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))
