"""Formulas in Typst: names, expressions, matrices."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.printing.printer import Printer

from robostiff.analytic.export.broken_lines import Breaks
from robostiff.analytic.export.displays import MathLanguage
from robostiff.analytic.export.products import printed_product
from robostiff.analytic.export.symbol_names import differential_parts, is_greek, name_parts
from robostiff.analytic.export.vocabulary import constant_name, function_name

_FUNCTIONS = {
    "acos": "arccos",
    "asin": "arcsin",
    "atan": "arctan",
    "atan2": 'op("atan2")',
    "log": "ln",
}


def typst_name(name: str) -> str:
    """Name of a symbol with its subscripts, in mathematics.

    Examples
    --------
    >>> [typst_name(name) for name in ("K_11", "mu_1", "u_1_3", "k_tau", "L_tip")]
    ['K_(11)', 'mu_(1)', 'u_(1,3)', 'k_(tau)', 'L_("tip")']
    """
    differential = differential_parts(name)
    if differential is not None:
        return f"frac(partial {typst_name(differential[0])}, partial {typst_name(differential[1])})"
    parts = name_parts(name)
    written = _word(parts.letter) + "'" * parts.primes
    if parts.subscripts:
        written += "_(" + ",".join(map(_word, parts.subscripts)) + ")"
    return written


def typst_matrix_name(name: str) -> str:
    """Name of a matrix or vector, in bold type.

    Examples
    --------
    >>> typst_matrix_name("K_1")
    'bold(upright(K))_(1)'
    """
    differential = differential_parts(name)
    if differential is not None:
        above = f"partial {typst_matrix_name(differential[0])}"
        return f"frac({above}, partial {typst_name(differential[1])})"
    letter, *subscripts = typst_name(name).split("_", 1)
    bare = letter.rstrip("'")
    primes = letter[len(bare) :]
    return "_".join([f"bold(upright({bare})){primes}", *subscripts])


def typst_expression(expression: sp.Expr) -> str:
    """An expression in Typst.

    Examples
    --------
    >>> k, a = sp.symbols("k_1 phi")
    >>> typst_expression(-k * sp.cos(a) ** 2 / 3)
    '-frac(k_(1) cos^2 (phi), 3)'
    """
    return _TypstPrinter().doprint(expression)


def _word(word: str) -> str:
    if is_greek(word) or word.isdigit() or (len(word) == 1 and word.isalpha()):
        return word
    return _quoted(word)


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _matrix(rows: list[list[str]]) -> str:
    body = ";\n  ".join(", ".join(row) for row in rows)
    return f'mat(delim: "[",\n  {body})'


class _TypstPrinter(Printer):
    """Expressions of the vocabulary, and other functions by their name."""

    printmethod = "_typst"

    def emptyPrinter(self, expr: sp.Basic) -> str:
        if not expr.args:
            return _quoted(str(expr))
        arguments = ", ".join(self._print(argument) for argument in expr.args)
        name = function_name(expr)
        if name is None:
            return f"op({_quoted(str(expr.func))}) ({arguments})"
        written = _FUNCTIONS.get(name, name)
        blank = " " if written.startswith("op(") else ""
        return f"{written}{blank}({arguments})"

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return typst_name(expr.name)

    def _print_Integer(self, expr: sp.Integer) -> str:
        return str(expr)

    def _print_Float(self, expr: sp.Float) -> str:
        mantissa, _, exponent = sp.sstr(expr, full_prec=False).partition("e")
        return f"{mantissa} dot 10^({exponent})" if exponent else mantissa

    def _print_Rational(self, expr: sp.Rational) -> str:
        return self._product(expr)

    def _print_NumberSymbol(self, expr: sp.NumberSymbol) -> str:
        return {"pi": "pi", "e": "upright(e)"}.get(constant_name(expr) or "", _quoted(str(expr)))

    def _print_Add(self, expr: sp.Add) -> str:
        written = ""
        for term in expr.as_ordered_terms():
            text = self._print(term)
            if not written:
                written = text
            elif text.startswith("-"):
                written += f" - {text[1:]}"
            else:
                written += f" + {text}"
        return written

    def _print_Mul(self, expr: sp.Mul) -> str:
        return self._product(expr)

    def _print_Pow(self, expr: sp.Pow) -> str:
        base: Any = expr.base
        exponent: Any = expr.exp
        if exponent.is_Rational and exponent.is_negative:
            return self._product(expr)
        if exponent == sp.Rational(1, 2):
            return f"sqrt({self._print(base)})"
        # Small fractions are written in a line.
        is_fraction = exponent.is_Rational and not exponent.is_Integer
        power = f"{exponent.p}\\/{exponent.q}" if is_fraction else self._print(exponent)
        name = function_name(base)
        if name not in {None, "abs", "exp"} and exponent.is_Integer:
            function = _FUNCTIONS.get(name or "", name)
            arguments = ", ".join(self._print(argument) for argument in base.args)
            return f"{function}^{power} ({arguments})"
        bare = self._print(base)
        return f"{bare if base.is_Symbol or bare.isdigit() else f'({bare})'}^({power})"

    def _product(self, expr: sp.Expr) -> str:
        product = printed_product(expr)
        above = self._factors(product.above, alone=not product.below)
        written = f"frac({above}, {self._factors(product.below)})" if product.below else above
        return f"-{written}" if product.negative else written

    def _factors(self, factors: tuple[sp.Expr, ...], *, alone: bool = False) -> str:
        if len(factors) == 1 and not alone:
            return self._print(factors[0])
        written = ""
        for factor in factors:
            text = self._print(factor)
            if factor.is_Add or text.startswith("-"):
                text = f"({text})"
            between = " dot " if written and text[0].isdigit() else " " if written else ""
            written += between + text
        return written or "1"


TYPST = MathLanguage(
    breaks=Breaks(typst_expression, r"\(", r"\)", r"\/", "^({})"),
    name=typst_name,
    matrix_name=typst_matrix_name,
    matrix=_matrix,
    fraction=lambda above, below: f"frac({above}, {below})",
    transposed="^sans(upright(T))",
    total="sum",
)
