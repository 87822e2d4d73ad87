"""A derivation as HTML, its formulas in MathML.

While they are put together, signs and brackets stand between the elements as plain characters;
`mathml` turns them into operators.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import Any, ClassVar

from robostiff.analytic.export.blocks import Title
from robostiff.analytic.export.language import Language, Row, Typeset
from robostiff.analytic.export.outline import outline_of
from robostiff.analytic.export.products import GREEK, is_greek
from robostiff.analytic.export.vocabulary import function_name
from robostiff.markup import element, escaped

_TOKEN = re.compile(r"(<[^>]+>)|([^<]+)")
_LEAF = re.compile(r"<(mi|mn|mo|mtext)\b")
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


_ROOM = 95.0
_PAGE_STYLE = """\
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 serif; }
.formula { overflow-x: auto; padding: 0.35rem 0; }
mi.matrix { font-weight: bold; }
table { border-collapse: collapse; margin: 0.5rem 2rem; }
td, th { padding: 0.15rem 0.8rem; text-align: left; }
th { border-bottom: 1px solid; font-weight: normal; }
"""


def derivation_html(derivation: Any, *, first_heading: int = 1) -> str:
    """A derivation as a fragment of HTML, with formulas in MathML.

    Parameters
    ----------
    derivation : Formula
    first_heading : int
        Level of its title, 1 to 5.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> k = sp.Symbol("k_tau")
    >>> K = sp.ImmutableMatrix(sp.diag(k, k, 0))
    >>> html = derivation_html(Derivation("K_C", K, (), K))
    >>> "<msub><mi>k</mi><mi>τ</mi></msub>" in html
    True
    """
    return "\n".join(_Html(_ROOM, first_heading).document(outline_of(derivation)))


def derivation_page(derivation: Any) -> str:
    """A derivation as a whole page of HTML.

    Examples
    --------
    >>> import sympy as sp
    >>> from robostiff.analytic import Derivation
    >>> K = sp.ImmutableMatrix(sp.diag(2, 2, 0))
    >>> page = derivation_page(Derivation("K_C", K, (), K))
    >>> page.startswith("<!DOCTYPE html>")
    True
    """
    blocks = outline_of(derivation)
    title = next(block.text for block in blocks if isinstance(block, Title))
    head = (
        '<meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{_PAGE_STYLE}</style>"
    )
    body = element("body", derivation_html(derivation))
    return f'<!DOCTYPE html>\n<html lang="en">{element("head", head)}\n{body}\n</html>\n'


class _Html(Typeset):
    """Expressions of the vocabulary in MathML, and other functions by their name."""

    printmethod = "_mathml"
    functions: ClassVar[dict[str, str]] = {
        "acos": "arccos",
        "asin": "arcsin",
        "atan": "arctan",
        "log": "ln",
    }
    constants: ClassVar[dict[str, str]] = {"pi": "<mi>π</mi>", "e": "<mi>e</mi>"}
    scientific = "{}<mo>·</mo><msup><mn>10</mn>{}</msup>"
    minus, plus = "-", "+"
    opening, closing = '<mo stretchy="false">(</mo>', '<mo stretchy="false">)</mo>'
    slash, power = "<mo>/</mo>", "<msup><mrow></mrow><mrow>{}</mrow></msup>"
    fraction, root = "<mfrac><mrow>{}</mrow><mrow>{}</mrow></mfrac>", "<msqrt>{}</msqrt>"
    in_a_line = "<mn>{}</mn><mo>/</mo><mn>{}</mn>"
    raised, brackets = "<msup>{}<mrow>{}</mrow></msup>", "<mrow><mo>(</mo>{}<mo>)</mo></mrow>"
    partial, norm, zero = "<mo>∂</mo>", "<mrow><mo>|</mo>{}<mo>|</mo></mrow>", "<mn>0</mn>"
    cross, dot, apart = "<mo>×</mo>", "<mo>·</mo>", '<mspace width="0.17em"/>'
    transposed = '<msup><mrow></mrow><mi mathvariant="normal">T</mi></msup>'
    inverse = "<msup><mrow></mrow><mrow><mo>−</mo><mn>1</mn></mrow></msup>"
    matrix_signs = (
        "<mrow><mo>[</mo><mtable><mtr><mtd>",
        "</mtd><mtd>",
        "</mtd></mtr><mtr><mtd>",
        "</mtd></mtr></mtable><mo>]</mo></mrow>",
    )
    list_signs = (["<dl>"], "<dt>{}</dt><dd>{}</dd>", ["</dl>"])
    total, total_over = "<mo>∑</mo>", "<munder><mo>∑</mo><mi>{}</mi></munder>"

    def word(self, word: str) -> str:
        if is_greek(word):
            letter = GREEK[word.lower()]
            return f"<mi>{letter if word in GREEK else letter.upper()}</mi>"
        if word.isdigit():
            return f"<mn>{word}</mn>"
        return f"<mi>{escape(word)}</mi>" if len(word) == 1 else f"<mtext>{escape(word)}</mtext>"

    def bold(self, letter: str) -> str:
        return f'<mi mathvariant="normal" class="matrix">{escape(letter)}</mi>'

    def number(self, digits: str) -> str:
        return f"<mn>{digits.replace('-', '−')}</mn>"

    def subscripted(self, letter: str, primes: int, subscripts: Sequence[str]) -> str:
        if primes:
            letter = f"<msup>{letter}<mo>{'′' * primes}</mo></msup>"
        if not subscripts:
            return letter
        below = "<mo>,</mo>".join(subscripts)
        below = f"<mrow>{below}</mrow>" if len(subscripts) > 1 else below
        return f"<msub>{letter}{below}</msub>"

    def inline(self, formula: str) -> str:
        return element("math", mathml(formula))

    def words(self, text: str) -> str:
        return escaped(text)

    def heading(self, text: str, level: int) -> str:
        return element(f"h{min(self.first + level - 1, 6)}", text)

    def paragraph(self, text: str) -> str:
        return element("p", text)

    def table(self, rows: list[list[str]]) -> str:
        kinds = ["th", *["td"] * (len(rows) - 1)]
        cells = ["".join(element(x, c) for c in row) for x, row in zip(kinds, rows, strict=True)]
        return element("table", "".join(element("tr", row) for row in cells))

    def display(self, rows: Sequence[Row]) -> list[str]:
        """The left-hand side once, then the lines of the right-hand side."""
        lines = []
        for row in rows:
            for number, line in enumerate(row.lines):
                left = f"{mathml(row.left)}<mo>=</mo>" if number == 0 else ""
                indented = "" if number == 0 else '<mspace width="2em"></mspace>'
                cells = element("mtd", left, style="text-align: right; padding-right: 0")
                right = element("mtd", indented + mathml(line), style="text-align: left")
                lines.append(element("mtr", cells + right))
        table = element("mtable", "".join(lines), displaystyle="true")
        return [element("div", element("math", table), class_="formula")]

    def applied(self, function: Any, power: str = "") -> str:
        arguments = "<mo>,</mo>".join(self._print(argument) for argument in function.args)
        name = function_name(function)
        if name == "abs" and not power:
            return self.norm.format(arguments)
        written = f"<mi>{escape(self.functions.get(name or '', name or str(function.func)))}</mi>"
        if power:
            written = self.raised.format(written, power)
        return f"{written}{_APPLY}{self.in_brackets(arguments)}"

    def times(self, factor: str, *, apart: bool) -> str:
        if factor.startswith("<mn>"):
            return self.dot
        is_function = _APPLY in factor and not factor.startswith("<mrow>")
        return f"{_TIMES}{self.apart}" if apart or is_function else _TIMES


#: Formulas in MathML, still with plain signs between their elements.
MATHML: Language = _Html(_ROOM)
