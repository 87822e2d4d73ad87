"""A formula as a function of a language: SymPy's printer, guards, a template."""

from __future__ import annotations

import keyword
import re
import unicodedata
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from itertools import chain, count
from string import Template
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from sympy.printing.c import get_math_macros, known_functions_C99, reserved_words
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import PRECEDENCE

from robostiff.analytic.calculus import FormulaDerivative
from robostiff.analytic.export.entries import (
    FUNCTIONS,
    constant_name,
    function_name,
    greek_or,
    title_of,
    unknown,
)
from robostiff.analytic.export.language import wrapped_formula, wrapped_words
from robostiff.analytic.export.program import LARGE, FormulaProgram, program
from robostiff.errors import InputError
from robostiff.spatial import Space

_NUMBERS = 8  # letters for a number behind an identifier

# Of C, beside those that SymPy knows: functions and macros of mathematics.
_C_OTHER = """
    abs labs cbrt ceil copysign fdim fmax fmin fmod frexp ilogb ldexp lgamma llrint llround logb
    lrint lround modf nan nearbyint nextafter nexttoward remainder remquo rint round scalbln scalbn
    tgamma trunc
    inline restrict main fabs pow gamma j0 j1 jn y0 y1 yn isfinite isinf isnan isnormal signbit NULL
    HUGE_VAL HUGE_VALF HUGE_VALL INFINITY NAN FP_INFINITE FP_NAN FP_NORMAL FP_SUBNORMAL FP_ZERO
    FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN MATH_ERRNO MATH_ERREXCEPT
    math_errhandling M_LOG10E linux unix i386
"""
_JULIA_KEYWORDS = """
    abstract baremodule begin break catch const continue do else elseif end export false finally for
    function global if import in isa let local macro module mutable primitive quote return struct
    true try type using where while
    sqrt pi zeros all isfinite throw DomainError float typeof Float64 Inf NaN im missing nothing
"""
_MATLAB_KEYWORDS = """
    break case catch classdef continue do else elseif end endfunction endif endwhile endfor
    end_try_catch end_unwind_protect for function global if otherwise parfor persistent return spmd
    switch try until unwind_protect unwind_protect_cleanup while
    sqrt pi zeros all isfinite error NaN eps
"""

#: Identifiers that generated functions must not define.
C_WORDS: frozenset[str] = frozenset(
    [*reserved_words, *known_functions_C99, *get_math_macros().values(), *_C_OTHER.split()]
)
PYTHON_WORDS: frozenset[str] = frozenset([*keyword.kwlist, *keyword.softkwlist, "np", "float"])
JULIA_WORDS: frozenset[str] = frozenset([*_JULIA_KEYWORDS.split(), *FUNCTIONS])
MATLAB_WORDS: frozenset[str] = frozenset([*_MATLAB_KEYWORDS.split(), *FUNCTIONS])


def ascii_identifier(name: str) -> str:
    """Letters, digits and underscores, a letter first; Greek letters by their names."""
    each = (c if c.isascii() else greek_or(c) for c in unicodedata.normalize("NFKD", name))
    kept = "".join(c for c in each if not unicodedata.combining(c[0]))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", kept)
    return plain if plain[:1].isalpha() else f"v{plain}"


NO_ANSWER = "the formula does not hold at these values"
_LARGEST = sp.Integer(10) ** 300
_LARGEST_EXPONENT = 1000  # numerator and denominator
_EXACT = 2**53  # integers that are doubles
_FAILS = (
    "where the formula does not hold: where a denominator vanishes up to rounding, "
    "a radicand is negative, or a given value or K is not finite"
)


def plain_text(name: str) -> str:
    """A name inside a comment or a string: printable, without quotes and signs of comments."""
    kept = "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"*\\?%$`#')
    return " ".join(kept.split()) or "without a plain name"


class Code(CodePrinter):
    """A function in a language: its expressions, and the lines of its template.

    In a template, ``$name`` at the end of a line may stand for several lines. `entry`: has the
    matrix, row i and column j from 0, I and J from 1, and the place n; `both`: what holds before,
    and a test; `steps`: the target of an intermediate; `zeros`: a matrix before its entries.
    """

    language: ClassVar[str]
    reserved: ClassVar[frozenset[str]]  # identifiers that must not be defined
    extra: ClassVar[tuple[str, ...]] = ()  # further identifiers of the function
    longest: ClassVar[int | None] = None  # letters of an identifier
    width: ClassVar[int] = 92  # of lines that may still be indented
    end: ClassVar[str] = ""  # of a statement
    goes_on: ClassVar[str] = ""  # at the end of a line that the next one continues
    in_brackets: ClassVar[bool] = False  # whether statements of several lines need brackets
    size: ClassVar[str] = "abs"
    zero: ClassVar[str] = "0"
    pi: ClassVar[str] = "pi"
    e: ClassVar[str] = "exp(1)"
    entry: ClassVar[str]
    text: ClassVar[str]  # the template
    steps: ClassVar[str] = "{}"
    both: ClassVar[str] = "{} && {}"
    zeros: ClassVar[str] = "{}"
    fails: ClassVar[str] = "It fails"
    subject: ClassVar[str] = "It"
    shape: ClassVar[str] = "{n} x {n}"

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__({"order": None})
        is_identifier = ascii_identifier(name) == name and len(name) <= (self.longest or len(name))
        if not is_identifier or name in self.reserved:
            expected = f"an identifier of {self.language}"
            raise InputError("name of the function", got=name, expected=expected)
        self.name = name
        self.is_stiffness: bool = getattr(derivation, "is_stiffness", True)
        title, by = getattr(derivation, "name", ""), ""
        if isinstance(derivation, FormulaDerivative):
            title, by = derivation.derivation.name, derivation.symbol.name
        self.title: str = title_of(title) if self.is_stiffness else f"Cartesian {title}"
        self.title += f" with its derivative by {by}" * bool(by)
        is_program = isinstance(derivation, FormulaProgram)
        self.compute: FormulaProgram = derivation if is_program else program(derivation)
        self._taken, take, given = {name}, self._take, self.compute.arguments
        symbols = (*given, *(a.symbol for a in self.compute.assignments))
        self._names = {symbol: take(symbol.name) for symbol in symbols}
        self.arguments: list[str] = [self._names[symbol] for symbol in given]
        self.results: list[str] = [take(x) for x in ("K", "dK")[: len(self.compute.results)]]
        self.n: int = self.compute.results[0].rows
        self.fields: dict[str, Any] = {x: take(x) for x in ("holds", *self.extra)}
        self.template: str = self.text

    def _take(self, name: str) -> str:
        """An identifier like a name: ``lambda_``, ``K_C_1``, ``phi``, and ``phi_2`` for another."""
        plain = ascii_identifier(name)[: self.longest and self.longest - _NUMBERS]
        plain += "_" * (plain in self.reserved or plain == self.name)
        others = (f"{plain.rstrip('_')}_{number}" for number in count(2))
        taken = self._taken | self.reserved
        self._taken.add(identifier := next(x for x in chain([plain], others) if x not in taken))
        return identifier

    def source(self) -> str:
        """All lines of the function as one text."""
        n, holds = self.n, self.fields["holds"]
        fields = {
            **{"name": self.name, "n": n, "no_answer": NO_ANSWER},
            **{"results": ", ".join(self.results), "comment": self.comment()},
            **self.fields,
            **self.parts(),
        }
        fields["steps"] = [
            line
            for a in self.compute.assignments
            for line in self.assignment(self.steps.format(self._names[a.symbol]), a.expression)
        ]
        matrices: list[str] = []
        for K, matrix in zip(self.results, self.compute.results, strict=True):
            matrices.append(self.zeros.format(K, n=n, nn=n**2, **self.fields))
            for i, j in np.ndindex(n, n):
                if matrix[i, j] != 0:
                    is_copy = j < i and matrix[i, j] == matrix[j, i]
                    entry = self._entry(K, j, i) if is_copy else matrix[i, j]
                    matrices += self.assignment(self._entry(K, i, j), entry)
        tests = [f"{size} > {least}" for size, least in self.guards()]
        tests += [f"{self._print(x)} {sign} {self.zero}" for _, x, sign in self.compute.conditions]
        each = (self.assignment(holds, self.both.format(holds, test)) for test in tests)
        fields |= {"matrices": matrices, "tests": [line for rows in each for line in rows]}
        lines: list[str] = []
        for line in self.template.splitlines():
            before, _, name = line.rpartition("$")
            rows = fields.get(name)
            rows = [before + x for x in rows] if isinstance(rows, list) else None
            lines += [Template(line).substitute(fields)] if rows is None else rows
        return "\n".join([*(line.rstrip() for line in lines), ""])

    @abstractmethod
    def parts(self) -> Mapping[str, str | list[str]]:
        """What else the template has."""

    # --- expressions ---

    def call(self, function: str, arguments: list[str]) -> str:
        """A function of the vocabulary, or sqrt."""
        return f"{function}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        """A power with a positive exponent."""
        return sign.join(self.parenthesize(x, PRECEDENCE["Pow"]) for x in (base, exponent))

    def _print(self, expr: Any, **settings: Any) -> str:
        """Only what is of the vocabulary: what is written may be run."""
        known = constant_name(expr) or function_name(expr)
        if known or isinstance(expr, sp.Rational | sp.Float | sp.Symbol | sp.Add | sp.Mul | sp.Pow):
            return super()._print(expr, **settings)
        raise unknown(expr)

    def _print_Symbol(self, expr: Any) -> str:
        return self._names[expr]

    def _print_Integer(self, expr: Any) -> str:
        return str(expr) if abs(expr) <= _EXACT else self._print_Float(expr)

    def _print_Rational(self, expr: Any) -> str:
        if abs(expr.p) > LARGE or expr.q > LARGE:
            return self._print_Float(expr)
        return "/".join(self._print(sp.Integer(x)) for x in (expr.p, expr.q))

    def _print_Float(self, expr: Any) -> str:
        """The double that is nearest to a number."""
        if abs(expr) > _LARGEST or 0 < abs(expr) < 1 / _LARGEST:
            raise InputError("number", got=str(expr), expected="one that is a double")
        return repr(float(expr))

    def _print_Pi(self, expr: Any) -> str:
        return self.pi

    def _print_Exp1(self, expr: Any) -> str:
        return self.e

    def _print_Function(self, expr: Any) -> str:
        name = function_name(expr)
        return (
            self.call(name, list(map(self._print, expr.args))) if name else self.emptyPrinter(expr)
        )

    _print_ExpBase = _print_Abs = _print_Function

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        is_ratio = expr.exp.is_Rational and max(abs(expr.exp.p), expr.exp.q) <= _LARGEST_EXPONENT
        if not is_ratio:
            raise unknown(expr)
        if expr.exp.is_negative:
            return self._print_Mul(expr)
        if expr.exp == sp.S.Half:
            return self.call("sqrt", [self._print(expr.base)])
        return self.power(expr.base, expr.exp)

    # --- statements ---

    def on_lines(self, start: str, text: str) -> list[str]:
        """What goes on without brackets of its own, on as many lines as it needs."""
        lines = wrapped_formula(text, self.width - len(self.goes_on), start)
        return [*(line + self.goes_on for line in lines[:-1]), lines[-1]]

    def assignment(self, target: str, expression: Any) -> list[str]:
        """An assignment of an expression, or of what is written already."""
        written = expression if isinstance(expression, str) else self._print(expression)
        start = f"{target} = "
        if not self.in_brackets or len(start + written) <= self.width:
            return self.on_lines(start, written + self.end)
        return [f"{start}(", *wrapped_formula(written, self.width, "    "), ")"]

    def _entry(self, K: str, i: int, j: int) -> str:
        return self.entry.format(K, i=i, j=j, I=i + 1, J=j + 1, n=self.n * i + j)

    def guards(self) -> Iterator[tuple[str, str]]:
        """Sizes of sums that must not cancel, and the least that they may be."""
        for guard in self.compute.guards:
            whole, *terms = (f"{self.size}({self._print(x)})" for x in (guard.value, *guard.terms))
            yield whole, f"{guard.part}*({' + '.join(terms)})"

    # --- words ---

    def comment(self) -> list[str]:
        """Lines on the matrix, what it relates, its arguments, and where there is no answer."""
        space = Space.of_size(self.n)
        both = (
            f"the twist ({', '.join(space.twist_order)}) of the reference point",
            f"the wrench ({', '.join(space.wrench_order)}) about the reference point",
        )
        given, found = both if self.is_stiffness else both[::-1]
        law = "F = K t" if self.is_stiffness else "t = K F"
        shape, subject = (x.format(n=self.n, **self.fields) for x in (self.shape, self.subject))
        beside = dict.fromkeys(f"; unless {words}" for words, *_ in self.compute.conditions)
        start = f"{plain_text(self.title)} about the reference point, {shape}."
        convention = (
            f"{subject} relates {given} to {found}, {law}: translation before rotation, force "
            "before moment, SI units."
        )
        fails = self.failing(f"{plain_text(_FAILS + ''.join(beside))}.")
        start, convention = (wrapped_words(x, self.width - 4) for x in (start, convention))
        values = self.values()
        return [*start, "", *convention, "", *values, *[""] * bool(values), *fails]

    def failing(self, where: str) -> list[str]:
        """Lines on where there is no answer."""
        return wrapped_words(f"{self.fails} {where}", self.width - 4)

    def values(self) -> list[str]:
        """Lines on the arguments: what they are in the formula, where there is something to say."""
        lines = [f"  {x}: {words}" for x, words in self.description() if words]
        return ["Values:", *lines] if lines else []

    def description(self) -> Iterator[tuple[str, str]]:
        """The arguments, and what they are in the formula, with their units."""
        for written, symbol in zip(self.arguments, self.compute.arguments, strict=True):
            words = [] if written == symbol.name else [f"{plain_text(symbol.name)} of the formula"]
            meaning = self.compute.meanings.get(symbol.name)
            yield written, ", ".join([*words, *([plain_text(meaning)] if meaning else [])])
