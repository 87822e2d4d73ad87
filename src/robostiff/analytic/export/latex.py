"""A derivation as a fragment of LaTeX."""

from __future__ import annotations

from collections.abc import Sequence

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import Derivative
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import Display, displays
from robostiff.analytic.export.latex_math import LATEX, latex_words
from robostiff.analytic.export.matrix_names import MatrixName
from robostiff.analytic.export.outline import (
    Block,
    Heading,
    Nomenclature,
    Words,
)

# Letters of 10 pt that stand side by side in the text width of an article.
_ROOM = 58.0


def derivation_latex(derivation: Derivation | Derivative) -> str:
    r"""A derivation as a fragment of LaTeX, to be put into a document that loads amsmath.

    Matrices are bmatrix environments, named intermediates stand in align*. Entries for which a
    matrix has no room get a name; long sums are broken over several lines.

    Parameters
    ----------
    derivation : Derivation or Derivative

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
    start = "% needs \\usepackage{amsmath}\n\\begingroup\\allowdisplaybreaks"
    return "\n\n".join([start, *written, "\\endgroup"]) + "\n"


def _written(block: Block) -> list[str]:
    match block:
        case Heading(text, level):
            command = "subsection" if level == 1 else "paragraph"
            return [f"\\{command}*{{{latex_words(text)}}}"]
        case Words(text):
            return [latex_words(text)]
        case Nomenclature(rows):
            return ["\\paragraph*{Nomenclature}", _nomenclature(rows)]
        case _:
            return [_display(formula) for formula in displays(block, LATEX, _ROOM)]


def _display(formula: Display) -> str:
    if len(formula) == 1 and len(formula[0].lines) == 1:
        return f"\\[\n{formula[0].left} = {formula[0].lines[0]}\n\\]"
    return f"\\begin{{align*}}\n{aligned_rows(formula)}\n\\end{{align*}}"


def aligned_rows(formula: Display) -> str:
    """Equations one below the other, aligned at their equals signs."""
    rows = [
        f"{row.left} &= " + " \\\\\n&\\quad ".join(line for line in row.lines) for row in formula
    ]
    return " \\\\\n".join(rows)


def _nomenclature(rows: Sequence[tuple[tuple[MatrixName | str, ...], str]]) -> str:
    # Not a description: its labels are never broken over lines.
    items = [f"\\item {listed_names(names)}: {latex_words(meaning)}" for names, meaning in rows]
    return "\n".join(["\\begin{itemize}", *items, "\\end{itemize}"])


def listed_names(names: Sequence[MatrixName | str]) -> str:
    """Names in a sentence, each a formula of its own."""
    written = []
    for name in names:
        if isinstance(name, MatrixName):
            written.append(f"${LATEX.matrix_name(name.name)}$")
        else:
            written.append("\\ldots" if name == "..." else f"${LATEX.name(name)}$")
    return ", ".join(written)
