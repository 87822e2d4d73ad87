"""A derivation as Markdown with mathematics between dollar signs."""

from __future__ import annotations

import re

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import Display, displays
from robostiff.analytic.export.latex import LATEX, aligned_rows, latex_expression, listed_names
from robostiff.analytic.export.outline import (
    Block,
    Nomenclature,
    OutlineHeading,
    OutlineText,
    Table,
)

_ROOM = 70.0
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
    >>> print("\n".join(derivation_markdown(Derivation("K_C", K, (), K)).splitlines()[4:14]))
    ## Result
    <BLANKLINE>
    $$
    \mathbf{K}_{C} = \frac{k_{\tau}}{3} \begin{bmatrix}
    1 & 0 & 0 \\
    0 & 1 & 0 \\
    0 & 0 & 0
    \end{bmatrix}
    $$
    <BLANKLINE>
    """
    written = [text for block in outline_of(derivation) for text in _written(block)]
    return "\n\n".join(written) + "\n"


def _written(block: Block) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            return [f"{'#' * level} {_words(text)}"]
        case OutlineText(text):
            return [_words(text)]
        case Nomenclature(rows):
            items = [f"- {_names(names)}: {_words(meaning)}" for names, meaning in rows]
            return ["## Nomenclature", "\n".join(items)]
        case Table(head, rows):
            cells = [["leg", *(f"${LATEX.name(name)}$" for name in head)]]
            cells.append(["---"] * len(cells[0]))
            cells += [[_words(w), *(f"${latex_expression(x)}$" for x in own)] for w, own in rows]
            return ["\n".join(f"| {' | '.join(row)} |" for row in cells)]
        case _:
            return [_display(formula) for formula in displays(block, LATEX, _ROOM)]


def _words(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


def _names(names: tuple) -> str:
    return listed_names(names).replace("\\ldots", "…")


def _display(formula: Display) -> str:
    if len(formula) == 1 and len(formula[0].lines) == 1:
        return f"$$\n{formula[0].left} = {formula[0].lines[0]}\n$$"
    return f"$$\n\\begin{{aligned}}\n{aligned_rows(formula)}\n\\end{{aligned}}\n$$"
