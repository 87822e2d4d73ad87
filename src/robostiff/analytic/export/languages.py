"""The languages of formulas: plain text, LaTeX, Markdown with LaTeX in it, Typst, and MathML."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from html import escape
from itertools import groupby
from typing import Any, ClassVar

from sympy.printing.str import StrPrinter

from robostiff.analytic.export.entries import GREEK, decimal, ordered_terms
from robostiff.analytic.export.language import Language, Row, fit, wrapped_formula, wrapped_words
from robostiff.analytic.export.notation import Block, MatrixEquation
from robostiff.markup import element, escaped, typst_text


class _PlainText(Language):
    """Formulas on a line, or broken over several; matrices in columns of letters."""

    opening, closing, slash, power = "(", ")", "/", "^{}"
    cross, dot, norm, apart, partial = "x", ".", "|{}|", " ", ""
    transposed, inverse, total, total_over = "^T", "^-1", "sum of", "sum over {} of"
    dots, matrix_signs = "...", ("[", ", ", "; ", "]")

    def __init__(self, room: float = 88, first: int = 1) -> None:
        super().__init__(first=first)
        self.width: Any = room  # in letters; lines are broken as they are displayed

    def write(self, expression: Any) -> str:
        """An expression as SymPy writes it, numbers without zeros at their end."""
        return _TextPrinter().doprint(expression)

    def name(self, name: str, *, bold: bool = False) -> str:
        return name

    def inline(self, formula: str) -> str:
        return formula

    def words(self, text: str) -> str:
        return text

    def over(self, above: str, below: str) -> str:
        if above.endswith(self.transposed):
            return f"{above} / {below}"
        above = f"({above})" if " " in above and above[0] != "|" else above
        below = f"({below})" if re.search("[ */]", below) and below[0] != "|" else below
        return f"{above}/{below}"

    def heading(self, text: str, level: int) -> str:
        title = " ".join(text.split())
        return f"{title}\n{('=' if level == 1 else '-') * min(len(title), self.width)}"

    def paragraph(self, text: str) -> str:
        return "\n".join(wrapped_words(text, self.width))

    def listed(self, rows: Sequence[tuple[str, str]]) -> str:
        each = (wrapped_words(f"{names}: {meaning}", self.width, "    ") for names, meaning in rows)
        return "\n".join(line for lines in each for line in lines)

    def table(self, rows: list[list[str]]) -> str:
        padded = _pad(rows)
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
        factor, matrix, named = fit(
            block, lambda x: len(self.write(x)), width - around, stacked=True
        )
        if factor != 1:
            before = self.write(factor)
            start += f"({before}) * " if factor.is_Add else f"{before} * "
        cells = [[self.write(entry) for entry in row] for row in matrix.tolist()]
        rows = [f"[ {'  '.join(row)} ]" for row in _pad(cells)]
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


def _pad(rows: list[list[str]]) -> list[list[str]]:
    """Cells as wide as their columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [[x.ljust(w) for x, w in zip(row, widths, strict=True)] for row in rows]


class _TextPrinter(StrPrinter):
    """A positive term first."""

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        return ordered_terms(expr)

    def _print_Float(self, expr: Any) -> str:
        return decimal(expr)


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


class _Latex(Language):
    """Matrices are bmatrix environments, equations below one another stand in align*."""

    minus, plus, apart, cross, dot = " - ", " + ", r"\,", r"\times", r"\cdot"
    fraction, root, raised = r"\frac{{{}}}{{{}}}", r"\sqrt{{{}}}", "{}^{{{}}}"
    scientific, partial, norm = r"{} \cdot 10^{{{}}}", "\\partial ", r"\lvert {} \rvert"
    operator, other = r"\{}", r"\operatorname{{{}}}"
    constants: ClassVar[dict[str, str]] = {"pi": r"\pi", "e": "e"}
    opening, closing, slash, power = r"\bigl(", r"\bigr)", r"\big/", "^{{}}"
    transposed, inverse, dots = r"^{\mathsf{T}}", "^{-1}", r"\ldots"
    total, total_over, below = r"\sum", r"\sum_{{{}}}", "_{{{}}}"
    matrix_signs = ("\\begin{bmatrix}\n", " & ", " \\\\\n", "\n\\end{bmatrix}")
    # Not a description: its labels are never broken over lines.
    _start = r"\begin{itemize}\itemsep=0pt\parsep=0pt"
    list_signs = ([_start], r"\item {}: {}", [r"\end{itemize}"])

    def word(self, word: str) -> str:
        if word == "omicron":
            return "o"
        if word in GREEK:
            return f"\\{word}"
        if word.isascii() and ((len(word) == 1 and word.isalpha()) or word.isdigit()):
            return word
        kind = "mathrm" if word.isascii() and word.isalnum() else "text"
        return f"\\{kind}{{{latex_words(word)}}}"

    def bold(self, letter: str) -> str:
        return f"\\mathbf{{{latex_words(letter)}}}"

    def quoted(self, name: str) -> str:
        return latex_words(name)

    def matrix(self, rows: list[list[str]]) -> str:
        written = super().matrix(rows)  # fractions do not meet
        return written.replace(" \\\\\n", " \\\\[4pt]\n") if "\\frac" in written else written

    def in_brackets(self, written: str) -> str:
        is_high = any(command in written for command in ("\\frac", "\\sqrt", "\\sum"))
        return f"\\left({written}\\right)" if is_high else f"({written})"

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


# Letters of 10 pt side by side in the text of A4 upright (planar) and on its side (spatial).
ROOM_UPRIGHT = 84.0
ROOM_ON_ITS_SIDE = 112.0
_BETWEEN_COLUMNS = 3.0


class _Typst(Language):
    """Equations are scaled to the page where they are wider; short ones stand side by side."""

    apart, cross, dot, partial, norm = " thin ", "times", "dot", "partial ", "abs({})"
    fraction, root, in_a_line, raised = "frac({}, {})", "sqrt({})", r"{}\/{}", "{}^({})"
    scientific, operator, other, apply = "{} dot 10^({})", "{}", "op({})", " "
    constants: ClassVar[dict[str, str]] = {"pi": "pi", "e": "upright(e)"}
    opening, closing, slash, power = r"\(", r"\)", r"\/", "^({})"
    below, matrix_signs = "_({})", ('mat(delim: "[",\n  ', ", ", ";\n  ", ")")
    _shape = "columns: (16%, 1fr), stroke: none, inset: (x: 0pt, y: 3pt), column-gutter: 1em,"
    list_signs = ([f"#table({_shape}"], "  [{}], [{}],", [")"])
    transposed, inverse, total, total_over = "^sans(upright(T))", "^(-1)", "sum", "sum_{}"

    def listed(self, rows: Sequence[tuple[str, str]]) -> str:
        found = super().listed(rows)
        return f"#columns(2)[\n{found}\n]" if self.room == ROOM_ON_ITS_SIDE else found

    def word(self, word: str) -> str:
        is_bare = word in GREEK or word.isdigit() or (len(word) == 1 and word.isalpha())
        return word if is_bare else self.quoted(word)

    def quoted(self, name: str) -> str:
        within = name.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{within}"'

    def bold(self, letter: str) -> str:
        return f"bold(upright({self.word(letter)}))"

    def words(self, text: str) -> str:
        return typst_text(text)

    def matrix(self, rows: list[list[str]]) -> str:
        return super().matrix([[_large(x) for x in row] for row in rows])

    def heading(self, text: str, level: int) -> str:
        return f"{'=' * (self.first + level - 1)} {text}"

    def table(self, rows: list[list[str]]) -> str:
        each = [[f"${_large(x[1:-1])}$" if x[:1] == "$" else x for x in row] for row in rows]
        cells = [f"  {' '.join(f'[{cell}],' for cell in row)}" for row in each]
        cells.insert(1, "  table.hline(stroke: 0.5pt),")
        shape = f"columns: {len(rows[0])}, stroke: none, column-gutter: 1em,"
        if any("frac(" in cell for cell in cells):  # which do not meet
            shape += " inset: (x: 5pt, y: 8pt), align: horizon,"
        return "\n".join([f"#pad(left: 1.5em, table({shape}", *cells, "))"])

    def display(self, rows: Sequence[Row]) -> list[str]:
        """Short equations side by side; others in blocks of their own, which pages can break."""
        found = []
        for is_narrow, group in groupby(
            rows, lambda x: 2 * (x.width + _BETWEEN_COLUMNS) <= self.room
        ):
            members, written = list(group), []
            for row in members:
                first, *rest = row.lines
                start = f"{row.left} = {'& ' * bool(rest)}{first}"
                whole = " \\\n  ".join([start, *(f'& quad "" {line}' for line in rest)])
                written.append(f"$ {whole} $")
            if is_narrow and len(members) > 1:
                columns = int(self.room / (max(x.width for x in members) + _BETWEEN_COLUMNS))
                cells = "\n".join(f"  {x}," for x in written)
                found.append(f"#side-by-side({columns},\n{cells}\n)")
            else:
                found += [f"#fit({x})" for x in written]
        return found


def _large(cell: str) -> str:
    """A cell with its fractions as large as those of an equation."""
    return f"display({cell})" if "frac(" in cell else cell


_TOKEN = re.compile(r"(<[^>]+>)|([^<]+)")
_LEAF = re.compile(r"<(mi|mn|mo|mtext)\b")
_TIMES = "<mo>&#8290;</mo>"  # invisible


def mathml(written: str) -> str:
    """Signs and brackets between elements as operators."""
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


class _Html(Language):
    """Formulas in MathML.

    While they are put together, signs and brackets stand between the elements as plain characters;
    `mathml` turns them into operators.
    """

    minus, plus, apart = "-", "+", '<mspace width="0.17em"/>'
    cross, dot, partial = "<mo>×</mo>", "<mo>·</mo>", "<mo>∂</mo>"
    fraction, root = "<mfrac><mrow>{}</mrow><mrow>{}</mrow></mfrac>", "<msqrt>{}</msqrt>"
    in_a_line, raised = "<mn>{}</mn><mo>/</mo><mn>{}</mn>", "<msup>{}<mrow>{}</mrow></msup>"
    scientific = "{}<mo>·</mo><msup><mn>10</mn>{}</msup>"
    operator = other = "<mi>{}</mi>"
    apply, comma = "<mo>&#8289;</mo>", "<mo>,</mo>"
    constants: ClassVar[dict[str, str]] = {"pi": "<mi>π</mi>", "e": "<mi>e</mi>"}
    brackets, norm = "<mrow><mo>(</mo>{}<mo>)</mo></mrow>", "<mrow><mo>|</mo>{}<mo>|</mo></mrow>"
    opening, closing = '<mo stretchy="false">(</mo>', '<mo stretchy="false">)</mo>'
    slash, power = "<mo>/</mo>", "<msup><mrow></mrow><mrow>{}</mrow></msup>"
    transposed = '<msup><mrow></mrow><mi mathvariant="normal">T</mi></msup>'
    inverse = "<msup><mrow></mrow><mrow><mo>−</mo><mn>1</mn></mrow></msup>"
    matrix_signs = (
        "<mrow><mo>[</mo><mtable><mtr><mtd>",
        "</mtd><mtd>",
        "</mtd></mtr><mtr><mtd>",
        "</mtd></mtr></mtable><mo>]</mo></mrow>",
    )
    zero, list_signs = "<mn>0</mn>", (["<dl>"], "<dt>{}</dt><dd>{}</dd>", ["</dl>"])
    total, total_over = "<mo>∑</mo>", "<munder><mo>∑</mo><mi>{}</mi></munder>"

    def word(self, word: str) -> str:
        if word in GREEK:
            return f"<mi>{GREEK[word]}</mi>"
        if word.isdigit():
            return f"<mn>{word}</mn>"
        return f"<mi>{escape(word)}</mi>" if len(word) == 1 else f"<mtext>{escape(word)}</mtext>"

    def bold(self, letter: str) -> str:
        return f'<mi mathvariant="normal" class="matrix">{escape(letter)}</mi>'

    def quoted(self, name: str) -> str:
        return escape(name)

    def number(self, digits: str) -> str:
        return f"<mn>{digits.replace('-', '−')}</mn>"

    def subscripted(self, letter: str, primes: int, subscripts: Sequence[str]) -> str:
        if primes:
            letter = f"<msup>{letter}<mo>{'′' * primes}</mo></msup>"
        if not subscripts:
            return letter
        below = self.comma.join(subscripts)
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

    def times(self, factor: str, *, apart: bool) -> str:
        if factor.startswith("<mn>"):
            return self.dot
        is_function = self.apply in factor and not factor.startswith("<mrow>")
        return f"{_TIMES}{self.apart}" if apart or is_function else _TIMES


# Letters of 10 pt that stand side by side in the text width of an article, in Markdown and HTML.
_ROOM, _ROOM_OF_MARKDOWN, _ROOM_OF_HTML = 58.0, 70.0, 95.0

#: Formulas in plain text, of letters in a line.
TEXT: Language = _PlainText(88)
#: Formulas in LaTeX.
LATEX: _Latex = _Latex(_ROOM)
#: Formulas in LaTeX between words in Markdown.
MARKDOWN: Language = _Markdown(_ROOM_OF_MARKDOWN)
#: Formulas in Typst.
TYPST: _Typst = _Typst(ROOM_UPRIGHT)
#: Formulas in MathML, still with plain signs between their elements.
MATHML: Language = _Html(_ROOM_OF_HTML)
