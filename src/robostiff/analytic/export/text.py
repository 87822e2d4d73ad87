"""A derivation as plain text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sympy.printing.str import StrPrinter

from robostiff.analytic.export.blocks import Block, MatrixEquation
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.language import Language, Row, fitted
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.export.products import ordered_terms
from robostiff.errors import InputError

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

    Examples
    --------
    >>> import sympy as sp
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
    return "\n\n".join(_PlainText(width).document(outline_of(derivation))) + "\n"


class _PlainText(Language):
    """Formulas on a line, or broken over several; matrices in columns of letters."""

    opening, closing, slash, power = "(", ")", "/", "^{}"
    cross, dot, norm, apart = "x", ".", "|{}|", " "
    transposed, inverse, total, total_over = "^T", "^-1", "sum of", "sum over {} of"
    dots, matrix_signs = "...", ("[", ", ", "; ", "]")

    def __init__(self, width: int = 88) -> None:
        super().__init__()
        self.width = width

    def write(self, expression: Any) -> str:
        """An expression, numbers without zeros at their end."""
        return _TextPrinter({"full_prec": False}).doprint(expression)

    def name(self, name: str, *, bold: bool = False) -> str:
        return name

    def inline(self, formula: str) -> str:
        return formula

    def words(self, text: str) -> str:
        return text

    def over(self, above: str, below: str) -> str:
        if above.endswith(self.transposed):
            return f"{above} / {below}"
        return "/".join(f"({x})" if " " in x and x[0] != "|" else x for x in (above, below))

    def heading(self, text: str, level: int) -> str:
        title = " ".join(text.split())
        return f"{title}\n{('=' if level == 1 else '-') * min(len(title), self.width)}"

    def paragraph(self, text: str) -> str:
        return "\n".join(wrapped_words(text, self.width))

    def listed(self, rows: Sequence[tuple[str, str]]) -> str:
        each = (wrapped_words(f"{names}: {meaning}", self.width, "    ") for names, meaning in rows)
        return "\n".join(line for lines in each for line in lines)

    def table(self, rows: list[list[str]]) -> str:
        padded = _padded(rows)
        padded.insert(1, ["-" * len(x) for x in padded[0]])
        return "\n".join("  ".join(row).rstrip() for row in padded)

    def display(self, rows: Sequence[Row]) -> list[str]:
        each = (wrapped_formula(x.lines[0], self.width, f"{x.left} = ") for x in rows)
        return ["\n".join(line for lines in each for line in lines)]

    def part(self, block: Block) -> Iterator[str]:
        if not isinstance(block, MatrixEquation):
            yield from super().part(block)
            return
        start, width = f"{block.name} = ", self.width
        # Brackets, and two blanks between columns.
        around = 4 + 2 * (block.whole.cols - 1) + len(start)
        factor, matrix, named = fitted(
            block, lambda x: len(self.write(x)), width - around, stacked=True
        )
        if factor != 1:
            before = self.write(factor)
            start += f"({before}) * " if factor.is_Add else f"{before} * "
        cells = [[self.write(entry) for entry in row] for row in matrix.tolist()]
        rows = [f"[ {'  '.join(row)} ]" for row in _padded(cells)]
        if block.is_vector:
            lines = wrapped_formula(f"({', '.join(cells[0])})", width, start)
        elif len(start) + len(rows[0]) <= width:
            middle, blank = (len(rows) - 1) // 2, " " * len(start)
            lines = [(start if i == middle else blank) + row for i, row in enumerate(rows)]
        else:
            lines = [*wrapped_formula(start, width, rest=""), *("  " + row for row in rows)]
        yield "\n".join(lines)
        if named.rows:
            yield from super().part(named)


def _padded(rows: list[list[str]]) -> list[list[str]]:
    """Cells as wide as their columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [[x.ljust(w) for x, w in zip(row, widths, strict=True)] for row in rows]


class _TextPrinter(StrPrinter):
    """As SymPy writes it, a positive term first."""

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        return ordered_terms(expr)


#: Formulas in plain text.
TEXT: Language = _PlainText()
