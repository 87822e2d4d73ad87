"""A derivation as plain text for a terminal."""

from __future__ import annotations

import math
from typing import Any

import sympy as sp
from sympy.printing.str import StrPrinter

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import Breaks, wrapped_formula, wrapped_words
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import (
    MathLanguage,
    displayed,
    displays,
    listed_names,
    sentences,
    table_cells,
)
from robostiff.analytic.export.entries import MatrixName
from robostiff.analytic.export.outline import (
    Block,
    FormulaTable,
    MatrixEquation,
    Nomenclature,
    OutlineHeading,
    OutlineText,
)
from robostiff.analytic.export.products import ordered_terms
from robostiff.errors import InputError

_NARROWEST = 60


def derivation_text(derivation: Derivation | FormulaDerivative, width: int = 88) -> str:
    r"""A derivation as plain text: the start, each passive joint, the result.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
    width : int
        Longest line. Longer expressions go on in the next line, indented; entries for which a
        matrix has no room get a name.

    Raises
    ------
    InputError
        When there is too little width for a matrix.

    Examples
    --------
    >>> from robostiff.analytic.chain import derive_chain
    >>> k, d, c = sp.symbols("k d c")
    >>> K = sp.Matrix([[k, 0, 0], [0, k, k * d], [0, k * d, k * d**2 + c]])
    >>> lines = derivation_text(derive_chain(K, {"tip": [0, 0, 1]})).splitlines()
    >>> print("\n".join(lines[12:26]))
    Joint 1: tip
    ------------
    <BLANKLINE>
    rotation about z at the reference point: trivial joint (19), row and column 3 vanish.
    <BLANKLINE>
    J_1 = (0, 0, 1)
    <BLANKLINE>
    u_1 = (0, d*k, c + d**2*k)
    <BLANKLINE>
    mu_1 = c + d**2*k
    <BLANKLINE>
    K_1 = K_0 - u_1 u_1^T / mu_1
    <BLANKLINE>
    K_1 = K_C
    """
    if width < _NARROWEST:
        raise InputError("width", got=width, expected=f"{_NARROWEST} characters or more")
    blocks = [_written(block, width) for block in outline_of(derivation)]
    return "\n\n".join("\n".join(lines) for lines in blocks) + "\n"


def _written(block: Block, width: int) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            title = " ".join(text.split())
            lines = [title, ("=" if level == 1 else "-") * min(len(title), width)]
        case OutlineText():
            lines = wrapped_words(sentences(block, TEXT, str), width)
        case MatrixEquation():
            lines = _matrix(block, width)
        case Nomenclature(named):
            lines = _nomenclature(named, width)
        case FormulaTable():
            cells = table_cells(block, TEXT)
            widths = [max(len(row[j]) for row in cells) for j in range(len(cells[0]))]
            padded = [[x.ljust(w) for x, w in zip(row, widths, strict=True)] for row in cells]
            padded.insert(1, ["-" * w for w in widths])
            lines = ["  ".join(row).rstrip() for row in padded]
        case _:
            rows = [row for formula in displays(block, TEXT, math.inf) for row in formula]
            formulas = [wrapped_formula(row.lines[0], width, f"{row.left} = ") for row in rows]
            lines = [line for formula in formulas for line in formula]
    return lines


def _matrix(block: MatrixEquation, width: int) -> list[str]:
    start = f"{block.name.name} = "
    # Brackets, and two blanks between columns.
    around = 4 + 2 * (block.whole.cols - 1) + len(start)
    fitting = displayed(block, _length, width - around, stacked=True)
    if fitting.factor != 1:
        factor = plain_text(fitting.factor)
        start += f"({factor}) * " if fitting.factor.is_Add else f"{factor} * "
    if block.is_vector:
        lines = wrapped_formula(
            f"({', '.join(map(plain_text, fitting.matrix.flat()))})", width, start
        )
    else:
        cells = [[plain_text(entry) for entry in row] for row in fitting.matrix.tolist()]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        padded = [[x.ljust(w) for x, w in zip(row, widths, strict=True)] for row in cells]
        rows = [f"[ {'  '.join(row)} ]" for row in padded]
        if len(start) + len(rows[0]) <= width:
            middle = (len(rows) - 1) // 2
            blank = " " * len(start)
            lines = [(start if i == middle else blank) + row for i, row in enumerate(rows)]
        else:
            lines = [*wrapped_formula(start, width, rest=""), *("  " + row for row in rows)]
    return [*lines, "", *_written(fitting.named, width)] if fitting.named.rows else lines


def plain_text(expression: sp.Basic) -> str:
    """An expression as text, numbers without zeros at their end."""
    return _TextPrinter({"full_prec": False}).doprint(expression)


class _TextPrinter(StrPrinter):
    """As SymPy writes it, a positive term first."""

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        return ordered_terms(expr)


def _fraction(above: str, below: str) -> str:
    if above.endswith(TEXT.transposed):
        return f"{above} / {below}"
    bracketed = [f"({x})" if " " in x and x[0] != "|" else x for x in (above, below)]
    return "/".join(bracketed)


TEXT = MathLanguage(
    breaks=Breaks(plain_text, "(", ")", "/", "^{}"),
    name=str,
    matrix_name=str,
    matrix=lambda rows: f"[{'; '.join(', '.join(row) for row in rows)}]",
    fraction=_fraction,
    transposed="^T",
    total="sum of",
    inverse="^-1",
    times="x",
    apart=" ",
    number=str,
    dot=".",
    norm=lambda written: f"|{written}|",
    total_over=lambda index: f"sum over {index} of",
    inline=str,
    brackets="({})".format,
)


def _length(expression: sp.Basic) -> float:
    return len(plain_text(expression))


def _nomenclature(
    named: tuple[tuple[tuple[MatrixName | str, ...], str], ...], width: int
) -> list[str]:
    lines = ["Nomenclature", "-" * len("Nomenclature"), ""]
    for names, meaning in named:
        lines += wrapped_words(f"{listed_names(names, TEXT, '...')}: {meaning}", width, "    ")
    return lines
