"""A derivation as HTML, its formulas in MathML.

While they are put together, signs and brackets stand between the elements as plain characters;
`mathml` turns them into operators.
"""

from __future__ import annotations

import re
from functools import partial
from html import escape

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
from robostiff.analytic.export.outline import (
    Block,
    FormulaTable,
    Nomenclature,
    OutlineHeading,
    OutlineText,
)
from robostiff.analytic.export.products import (
    GREEK,
    FormulaPrinter,
    differential_parts,
    is_greek,
    name_parts,
)
from robostiff.analytic.export.vocabulary import constant_name, function_name
from robostiff.markup import element, escaped

_FUNCTIONS = {"acos": "arccos", "asin": "arcsin", "atan": "arctan", "log": "ln"}
_TOKEN = re.compile(r"(<[^>]+>)|([^<]+)")
_LEAF = re.compile(r"<(mi|mn|mo|mtext)\b")
_FRACTION = "<mfrac><mrow>{}</mrow><mrow>{}</mrow></mfrac>"
_TIMES = "<mo>&#8290;</mo>"  # invisible
_APPLY = "<mo>&#8289;</mo>"  # a function


def mathml(written: str) -> str:
    """Signs and brackets between elements as operators.

    Examples
    --------
    >>> mathml("<mi>a</mi> - (<mn>1</mn>)")
    '<mi>a</mi><mo>−</mo><mo>(</mo><mn>1</mn><mo>)</mo>'
    """
    out: list[str] = []
    inside_leaf = False
    for tag, text in _TOKEN.findall(written):
        if tag:
            out.append(tag)
            inside_leaf = bool(_LEAF.match(tag))
        elif inside_leaf:
            out.append(text)
        else:
            signs = (sign.replace("-", "−") for sign in text if not sign.isspace())
            out += [f"<mo>{sign}</mo>" for sign in signs]
    return "".join(out)


def mathml_expression(expression: sp.Expr) -> str:
    """An expression in MathML, still with plain signs between its elements."""
    return _MathMLPrinter().doprint(expression)


def mathml_name(name: str, *, bold: bool = False) -> str:
    """Name of a symbol with its subscripts; of a matrix or vector in bold type."""
    differential = differential_parts(name)
    if differential is not None:
        inner, by = differential
        above = f"<mo>∂</mo>{mathml_name(inner, bold=bold)}"
        return _FRACTION.format(above, f"<mo>∂</mo>{mathml_name(by)}")
    parts = name_parts(name)
    letter = _word(parts.letter)
    if bold:
        letter = f'<mi mathvariant="normal" class="matrix">{escape(parts.letter)}</mi>'
    if parts.primes:
        letter = f"<msup>{letter}<mo>{'′' * parts.primes}</mo></msup>"
    if not parts.subscripts:
        return letter
    below = "<mo>,</mo>".join(map(_word, parts.subscripts))
    below = f"<mrow>{below}</mrow>" if len(parts.subscripts) > 1 else below
    return f"<msub>{letter}{below}</msub>"


def _word(word: str) -> str:
    if is_greek(word):
        letter = GREEK[word.lower()]
        return f"<mi>{letter if word in GREEK else letter.upper()}</mi>"
    if word.isdigit():
        return f"<mn>{word}</mn>"
    return f"<mi>{escape(word)}</mi>" if len(word) == 1 else f"<mtext>{escape(word)}</mtext>"


def _matrix(rows: list[list[str]]) -> str:
    cells = ("".join(f"<mtd>{entry}</mtd>" for entry in row) for row in rows)
    body = "".join(f"<mtr>{row}</mtr>" for row in cells)
    return f"<mrow><mo>[</mo><mtable>{body}</mtable><mo>]</mo></mrow>"


class _MathMLPrinter(FormulaPrinter):
    """Expressions of the vocabulary, and other functions by their name."""

    printmethod = "_mathml"
    minus, plus = "-", "+"
    fraction = _FRACTION
    root = "<msqrt>{}</msqrt>"
    in_a_line = "<mn>{}</mn><mo>/</mo><mn>{}</mn>"
    raised = "<msup>{}<mrow>{}</mrow></msup>"
    brackets = "<mrow><mo>(</mo>{}<mo>)</mo></mrow>"

    def emptyPrinter(self, expr: sp.Basic) -> str:
        return self.applied(expr) if expr.args else f"<mtext>{escape(str(expr))}</mtext>"

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return mathml_name(expr.name)

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"-<mn>{-expr}</mn>" if expr < 0 else f"<mn>{expr}</mn>"

    def _print_Float(self, expr: sp.Float) -> str:
        mantissa, _, exponent = sp.sstr(abs(expr), full_prec=False).partition("e")
        sign = "-" if expr < 0 else ""
        if not exponent:
            return f"{sign}<mn>{mantissa}</mn>"
        power = f"<msup><mn>10</mn><mn>{exponent.replace('-', '−')}</mn></msup>"
        return f"{sign}<mn>{mantissa}</mn><mo>·</mo>{power}"

    def _print_NumberSymbol(self, expr: sp.NumberSymbol) -> str:
        return (
            f"<mi>{ {'pi': 'π', 'e': 'e'}.get(constant_name(expr) or '', escape(str(expr))) }</mi>"
        )

    def applied(self, function: sp.Basic, power: str = "") -> str:
        arguments = "<mo>,</mo>".join(self._print(argument) for argument in function.args)
        name = function_name(function)
        if name == "abs" and not power:
            return f"<mrow><mo>|</mo>{arguments}<mo>|</mo></mrow>"
        written = f"<mi>{escape(_FUNCTIONS.get(name or '', name or str(function.func)))}</mi>"
        if power:
            written = self.raised.format(written, power)
        return f"{written}{_APPLY}{self.brackets.format(arguments)}"

    def times(self, factor: str, *, apart: bool) -> str:
        if factor.startswith("<mn>"):
            return "<mo>·</mo>"
        is_function = _APPLY in factor and not factor.startswith("<mrow>")
        return f'{_TIMES}<mspace width="0.17em"/>' if apart or is_function else _TIMES


MATHML = MathLanguage(
    breaks=Breaks(
        mathml_expression,
        '<mo stretchy="false">(</mo>',
        '<mo stretchy="false">)</mo>',
        "<mo>/</mo>",
        "<msup><mrow></mrow><mrow>{}</mrow></msup>",
    ),
    name=mathml_name,
    matrix_name=partial(mathml_name, bold=True),
    matrix=_matrix,
    fraction=_FRACTION.format,
    transposed='<msup><mrow></mrow><mi mathvariant="normal">T</mi></msup>',
    total="<mo>∑</mo>",
    inverse="<msup><mrow></mrow><mrow><mo>−</mo><mn>1</mn></mrow></msup>",
    times="<mo>×</mo>",
    apart='<mspace width="0.17em"/>',
    number=lambda number: f"<mn>{number}</mn>",
    dot="<mo>·</mo>",
    norm=lambda written: f"<mrow><mo>|</mo>{written}<mo>|</mo></mrow>",
    total_over=lambda index: f"<munder><mo>∑</mo><mi>{index}</mi></munder>",
    inline=lambda formula: element("math", mathml(formula)),
    brackets="({})".format,
)


_ROOM = 95.0
_PAGE_STYLE = """\
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 serif; }
.formula { overflow-x: auto; padding: 0.35rem 0; }
mi.matrix { font-weight: bold; }
table { border-collapse: collapse; margin: 0.5rem 2rem; }
td, th { padding: 0.15rem 0.8rem; text-align: left; }
th { border-bottom: 1px solid; font-weight: normal; }
"""


def derivation_html(derivation: Derivation | FormulaDerivative, *, first_heading: int = 1) -> str:
    """A derivation as a fragment of HTML, with formulas in MathML.

    Parameters
    ----------
    derivation : Derivation or FormulaDerivative
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


def derivation_page(derivation: Derivation | FormulaDerivative) -> str:
    """A derivation as a whole page of HTML.

    Examples
    --------
    >>> import sympy as sp
    >>> K = sp.ImmutableMatrix(sp.diag(2, 2, 0))
    >>> page = derivation_page(Derivation("K_C", K, (), K))
    >>> page.startswith("<!DOCTYPE html>")
    True
    """
    blocks = outline_of(derivation)
    title = next(block.text for block in blocks if isinstance(block, OutlineHeading))
    head = (
        '<meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{_PAGE_STYLE}</style>"
    )
    body = element("body", derivation_html(derivation))
    return f'<!DOCTYPE html>\n<html lang="en">{element("head", head)}\n{body}\n</html>\n'


def _written(block: Block, first: int) -> list[str]:
    match block:
        case OutlineHeading(text, level):
            return [element(f"h{min(first + level - 1, 6)}", escaped(text))]
        case OutlineText():
            return [element("p", sentences(block, MATHML, escaped))]
        case Nomenclature(rows):
            terms = "".join(
                element("dt", listed_names(names, MATHML)) + element("dd", escaped(meaning))
                for names, meaning in rows
            )
            return [element(f"h{min(first + 1, 6)}", "Nomenclature"), element("dl", terms)]
        case FormulaTable():
            return [_table(block)]
        case _:
            return [_display(formula) for formula in displays(block, MATHML, _ROOM)]


def _table(table: FormulaTable) -> str:
    rows = [[escaped(words), *own] for words, *own in table_cells(table, MATHML)]
    kinds = ["th", *["td"] * len(table.rows)]
    cells = ["".join(element(x, c) for c in row) for x, row in zip(kinds, rows, strict=True)]
    return element("table", "".join(element("tr", row) for row in cells))


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
