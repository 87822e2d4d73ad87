"""A derivation as HTML, its formulas in MathML."""

from __future__ import annotations

from collections.abc import Sequence

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import Derivative
from robostiff.analytic.export.derivative_outline import outline_of
from robostiff.analytic.export.displays import Display, Row, displays
from robostiff.analytic.export.mathml_math import MATHML, mathml
from robostiff.analytic.export.matrix_names import MatrixName
from robostiff.analytic.export.outline import Block, Heading, Nomenclature, Words
from robostiff.markup import element, escaped

_ROOM = 95.0
_PAGE_STYLE = """\
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 serif; }
.formula { overflow-x: auto; padding: 0.35rem 0; }
mi.matrix { font-weight: bold; }
"""


def derivation_html(derivation: Derivation | Derivative, *, first_heading: int = 1) -> str:
    """A derivation as a piece of HTML; browsers typeset its formulas without help.

    Parameters
    ----------
    derivation : Derivation or Derivative
    first_heading : int
        Level of its title, 1 to 5.

    Examples
    --------
    >>> import sympy as sp
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k, k, 0))
    >>> html = derivation_html(Derivation("K_C", K, (), K))
    >>> "<msub><mi>k</mi><mi>τ</mi></msub>" in html
    True
    """
    written = [text for block in outline_of(derivation) for text in _written(block, first_heading)]
    return "\n".join(written)


def derivation_page(derivation: Derivation | Derivative) -> str:
    """A derivation as a whole page of HTML.

    Examples
    --------
    >>> import sympy as sp
    >>> K = sp.ImmutableMatrix(sp.diag(2, 2, 0))
    >>> page = derivation_page(Derivation("K_C", K, (), K))
    >>> page.startswith("<!DOCTYPE html>")
    True
    """
    head = (
        '<meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(_title(derivation))}</title><style>{_PAGE_STYLE}</style>"
    )
    body = element("body", derivation_html(derivation))
    return f'<!DOCTYPE html>\n<html lang="en">{element("head", head)}\n{body}\n</html>\n'


def _title(derivation: Derivation | Derivative) -> str:
    return next(block.text for block in outline_of(derivation) if isinstance(block, Heading))


def _written(block: Block, first: int) -> list[str]:
    match block:
        case Heading(text, level):
            return [element(f"h{min(first + level - 1, 6)}", escaped(text))]
        case Words(text):
            return [element("p", escaped(" ".join(text.split())))]
        case Nomenclature(rows):
            terms = "".join(
                element("dt", _names(names)) + element("dd", escaped(meaning))
                for names, meaning in rows
            )
            return [element(f"h{min(first + 1, 6)}", "Nomenclature"), element("dl", terms)]
        case _:
            return [_display(formula) for formula in displays(block, MATHML, _ROOM)]


def _display(formula: Display) -> str:
    rows = "".join(line for row in formula for line in _lines(row))
    table = element("mtable", rows, displaystyle="true")
    return element("div", element("math", table), class_="formula")


def _lines(row: Row) -> list[str]:
    """Rows of a table: the left-hand side once, then the lines of the right-hand side."""
    written = []
    for number, line in enumerate(row.lines):
        left = f"{mathml(row.left)}<mo>=</mo>" if number == 0 else ""
        right = mathml(line) if number == 0 else f'<mspace width="2em"></mspace>{mathml(line)}'
        cells = element("mtd", left, style="text-align: right; padding-right: 0")
        cells += element("mtd", right, style="text-align: left")
        written.append(element("mtr", cells))
    return written


def _names(names: Sequence[MatrixName | str]) -> str:
    written = []
    for name in names:
        if isinstance(name, MatrixName):
            written.append(element("math", mathml(MATHML.matrix_name(name.name))))
        else:
            written.append("…" if name == "..." else element("math", mathml(MATHML.name(name))))
    return ", ".join(written)
