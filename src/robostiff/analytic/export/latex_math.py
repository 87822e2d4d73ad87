"""Formulas in LaTeX: names, expressions, matrices."""

from __future__ import annotations

import sympy as sp

from robostiff.analytic.export.broken_lines import Breaks
from robostiff.analytic.export.displays import MathLanguage
from robostiff.analytic.export.symbol_names import differential_parts, is_greek, name_parts

_ESCAPED = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{character: f"\\{character}" for character in "#$%&_"},
}


def latex_words(text: str) -> str:
    r"""Text for LaTeX, its special characters escaped.

    Examples
    --------
    >>> latex_words("100 % of a_b")
    '100 \\% of a\\_b'
    """
    return "".join(_ESCAPED.get(character, character) for character in " ".join(text.split()))


def latex_name(name: str) -> str:
    r"""Name of a symbol with its subscripts.

    Examples
    --------
    >>> [latex_name(name) for name in ("K_11", "mu_1", "u_1_3", "k_tau", "L'_tip")]
    ['K_{11}', '\\mu_{1}', 'u_{1,3}', 'k_{\\tau}', "L'_{\\mathrm{tip}}"]
    >>> latex_name("dmu_1_dR")
    '\\frac{\\partial \\mu_{1}}{\\partial R}'
    """
    return _subscripted(name, bold=False)


def latex_matrix_name(name: str) -> str:
    r"""Name of a matrix or vector, in bold type.

    Examples
    --------
    >>> latex_matrix_name("K_1")
    '\\mathbf{K}_{1}'
    """
    return _subscripted(name, bold=True)


def latex_expression(expression: sp.Expr) -> str:
    r"""An expression in LaTeX.

    Examples
    --------
    >>> k, a = sp.symbols("k_1 phi")
    >>> latex_expression(k * sp.cos(a) ** 2 / 3)
    '\\frac{k_{1} \\cos^{2}{\\left(\\phi \\right)}}{3}'
    """
    symbols = expression.atoms(sp.Symbol)
    names = {s: latex_name(s.name) for s in symbols}
    return sp.latex(expression, symbol_names=names, full_prec=False)


def _subscripted(name: str, *, bold: bool) -> str:
    differential = differential_parts(name)
    if differential is not None:
        inner, by = differential
        above = f"\\partial {_subscripted(inner, bold=bold)}"
        return f"\\frac{{{above}}}{{\\partial {latex_name(by)}}}"
    parts = name_parts(name)
    letter = f"\\mathbf{{{latex_words(parts.letter)}}}" if bold else _word(parts.letter)
    written = letter + "'" * parts.primes
    if parts.subscripts:
        written += "_{" + ",".join(map(_word, parts.subscripts)) + "}"
    return written


def _word(word: str) -> str:
    if word == "omicron":
        return "o"
    if is_greek(word):
        return f"\\{word}"
    if word.isascii() and ((len(word) == 1 and word.isalpha()) or word.isdigit()):
        return word
    return f"\\{'mathrm' if word.isascii() and word.isalnum() else 'text'}{{{latex_words(word)}}}"


def _matrix(rows: list[list[str]]) -> str:
    body = " \\\\\n".join(" & ".join(row) for row in rows)
    return f"\\begin{{bmatrix}}\n{body}\n\\end{{bmatrix}}"


LATEX = MathLanguage(
    breaks=Breaks(latex_expression, r"\bigl(", r"\bigr)", r"\big/", "^{{}}"),
    name=latex_name,
    matrix_name=latex_matrix_name,
    matrix=_matrix,
    fraction=lambda above, below: f"\\frac{{{above}}}{{{below}}}",
    transposed=r"^{\mathsf{T}}",
    total="\\sum",
)
