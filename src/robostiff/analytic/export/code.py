"""A derivation as a function of a language: SymPy's printer, guards, a template."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import PRECEDENCE

from robostiff.analytic.calculus import FormulaDerivative
from robostiff.analytic.export.language import wrapped_formula, wrapped_words
from robostiff.analytic.export.program import LARGE, FormulaProgram, program
from robostiff.analytic.export.vocabulary import Identifiers, ascii_identifier, function_name
from robostiff.errors import InputError
from robostiff.spatial import Space

NO_ANSWER = "the formula does not hold at these values"
_LARGEST = sp.Integer(10) ** 300
_EXACT = 2**53  # integers that are doubles
_FAILS = (
    "where the formula does not hold: where a denominator vanishes up to rounding, "
    "a radicand is negative, or a given value or K is not finite"
)


def plain_text(name: str) -> str:
    """A name inside a comment or a string: printable, without quotes and signs of comments."""
    kept = "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"*\\?%$`#')
    return " ".join(kept.split()) or "without a plain name"


def unquoted(name: str) -> str:
    """A name inside a string or a comment of Python."""
    kept = "".join(c for c in name if c.isprintable() and c not in '"\\')
    return " ".join(kept.split())


class Code(CodePrinter, ABC):
    """A program in a language: its expressions, and the lines of a function.

    `entry`: has the matrix, row i and column j from 0, I and J from 1, and the place n; `declared`:
    the target of an intermediate; `both`: what holds before, and a test.
    """

    name_of_language: ClassVar[str]
    reserved: ClassVar[frozenset[str]]  # identifiers that must not be defined
    own: ClassVar[tuple[str, ...]] = ()  # further identifiers of the function
    longest: ClassVar[int | None] = None  # letters of an identifier
    width: ClassVar[int] = 96  # of lines
    indent: ClassVar[int] = 4  # of the comment
    size: ClassVar[str] = "abs"
    zero: ClassVar[str] = "0"
    pi: ClassVar[str] = "pi"
    e: ClassVar[str] = "exp(1)"
    entry: ClassVar[str]
    declared: ClassVar[str] = "{}"
    both: ClassVar[str] = "{} && {}"
    functions: ClassVar[dict[str, str]] = {}  # by their names in the vocabulary
    # a name fit for a comment of the language
    plain: ClassVar[staticmethod[[str], str]] = staticmethod(plain_text)

    def __init__(self, derivation: Any, name: str) -> None:
        super().__init__({"order": None})
        is_identifier = ascii_identifier(name) == name and len(name) <= (self.longest or len(name))
        if not is_identifier or name in self.reserved:
            expected = f"an identifier of {self.name_of_language}"
            raise InputError("name of the function", got=name, expected=expected)
        self.name = name
        self.title: str = getattr(derivation, "name", "")
        if isinstance(derivation, FormulaDerivative):
            whole, symbol = derivation.derivation.name, derivation.symbol.name
            self.title = f"{whole} with its derivative by {symbol}"
        self.is_stiffness: bool = getattr(derivation, "is_stiffness", True)
        is_program = isinstance(derivation, FormulaProgram)
        compute = derivation if is_program else program(derivation)
        self.compute: FormulaProgram = compute
        self.identifiers: Identifiers = Identifiers({*self.reserved, name}, self.longest)
        take = self.identifiers.take
        symbols = (*compute.arguments, *(a.symbol for a in compute.assignments))
        self._names = {symbol: take(symbol.name) for symbol in symbols}
        self.arguments: list[str] = [self._names[symbol] for symbol in compute.arguments]
        self.results: list[str] = [take(x) for x in ("K", "dK")[: len(compute.results)]]
        self.n: int = compute.entries.rows
        self.holds: str = take("holds")
        self.others: list[str] = [take(x) for x in self.own]

    @abstractmethod
    def lines(self) -> list[str]:
        """The function and its comment."""

    def source(self) -> str:
        """All lines as one text."""
        return "\n".join([*(line.rstrip() for line in self.lines()), ""])

    def call(self, function: str, arguments: list[str]) -> str:
        """A function of the vocabulary, or sqrt."""
        return f"{self.functions.get(function, function)}({', '.join(arguments)})"

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        """A power with a positive exponent."""
        return sign.join(self.parenthesize(x, PRECEDENCE["Pow"]) for x in (base, exponent))

    def write(self, expression: Any) -> str:
        """An expression as a statement's right-hand side."""
        return self._print(expression)

    def _print_Symbol(self, expr: Any) -> str:
        return self._names[expr]

    def _print_Integer(self, expr: Any) -> str:
        return str(expr) if abs(expr) <= _EXACT else self._print_Float(expr)

    def _print_Rational(self, expr: Any) -> str:
        if abs(expr.p) > LARGE or expr.q > LARGE:
            return self._print_Float(expr)
        return "/".join(self._print_Integer(sp.Integer(x)) for x in (expr.p, expr.q))

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
        return self.call(function_name(expr) or "", [self._print(x) for x in expr.args])

    _print_ExpBase = _print_Abs = _print_Function

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        if expr.exp.is_negative:
            return self._print_Mul(expr)
        if expr.exp == sp.S.Half:
            return self.call("sqrt", [self._print(expr.base)])
        return self.power(expr.base, expr.exp)

    def about(self) -> Iterator[tuple[str, str]]:
        """Each argument, and what a comment says of it: its name in the formula, its meaning."""
        for written, symbol in zip(self.arguments, self.compute.arguments, strict=True):
            own = [] if written == symbol.name else [f"{self.plain(symbol.name)} of the formula"]
            meaning = self.compute.meanings.get(symbol.name)
            yield written, ", ".join([*own, self.plain(meaning)] if meaning else own)

    def comment(
        self, fails: str, of: Sequence[str] | None = None, subject: str = "It", shape: str = ""
    ) -> list[str]:
        """Lines on the matrix, what it relates, its arguments, and where there is no answer.

        `fails`: what happens there; `of`: lines on the arguments; `subject`: what relates.
        """
        n, width = self.n, self.width - self.indent
        of = [f"{x}: {words}" for x, words in self.about() if words] if of is None else of
        space = Space.of_size(n)
        both = (
            f"the twist ({', '.join(space.twist_order)}) of the reference point",
            f"the wrench ({', '.join(space.wrench_order)}) about the reference point",
        )
        given, found = both if self.is_stiffness else both[::-1]
        matrix, law = (
            ("Stiffness matrix", "F = K t") if self.is_stiffness else ("Cartesian", "t = K F")
        )
        title = f"{matrix} {self.plain(self.title)} about the reference point, "
        convention = (
            f"relates {given} to {found}, {law}: translation before rotation, force before moment, "
            "SI units."
        )
        return [
            *(*wrapped_words(f"{title}{shape or f'{n} x {n}'}.", width), ""),
            *(*wrapped_words(f"{subject} {convention}", width), ""),
            *(*of, *[""][: len(of)]),
            *wrapped_words(f"{fails} {self.failure()}.", width),
        ]

    def failure(self) -> str:
        """Where there is no answer, in words."""
        beside = dict.fromkeys(unquoted(own) for own, *_ in self.compute.conditions)
        return self.plain(_FAILS + "".join(f"; unless {own}" for own in beside))

    def tests(self) -> list[str]:
        """Lines that say where the formula holds."""
        tests = [f"{size} > {least}" for size, least in self._guarded()]
        tests += [f"{self.write(x)} {sign} {self.zero}" for _, x, sign in self.compute.conditions]
        each = (self.assigned(self.holds, self.both.format(self.holds, test)) for test in tests)
        return [line for own in each for line in own]

    def broken(self, text: str, start: str, rest: str = "    ") -> list[str]:
        """What may take more lines than one."""
        return wrapped_formula(text, self.width, start, rest)

    def margins(self) -> list[str]:
        """What is positive where the formula holds, or not negative, in the order of its tests."""
        margins = [f"{size} - {least}" for size, least in self._guarded()]
        return [*margins, *(self.write(x) for _, x, _ in self.compute.conditions)]

    def _guarded(self) -> Iterator[tuple[str, str]]:
        """Sizes of sums that must not cancel, and the least that they may be."""
        for guard in self.compute.guards:
            whole, *terms = (f"{self.size}({self.write(x)})" for x in (guard.value, *guard.terms))
            yield whole, f"{guard.part}*({' + '.join(terms)})"

    def intermediates(self) -> list[str]:
        """Lines that compute what the matrices need."""
        each = ((self._names[a.symbol], a.expression) for a in self.compute.assignments)
        lines = (self.assigned(self.declared.format(x), self.write(e)) for x, e in each)
        return [line for own in lines for line in own]

    def matrices(self, zeros: str) -> list[str]:
        """Lines that compute the matrices; `zeros`: the line that makes one, of its name."""
        lines: list[str] = []
        for K, matrix in zip(self.results, self.compute.results, strict=True):
            rows = matrix.tolist()
            lines.append(zeros.format(K))
            for i, j in np.ndindex(self.n, self.n):
                if rows[i][j] != 0:
                    is_copy = j < i and rows[i][j] == rows[j][i]
                    written = self.place(K, j, i) if is_copy else self.write(rows[i][j])
                    lines += self.assigned(self.place(K, i, j), written)
        return lines

    def place(self, K: str, i: int, j: int) -> str:
        """The entry of a matrix in row i and column j, from 0."""
        return self.entry.format(K, i=i, j=j, I=i + 1, J=j + 1, n=self.n * i + j)

    def assigned(self, target: str, expression: str) -> list[str]:
        """An assignment, in brackets where it takes more than a line: of Python and of Julia."""
        line = f"    {target} = {expression}"
        if len(line) <= self.width:
            return [line]
        inside = wrapped_formula(expression, self.width, " " * 8, " " * 8)
        return [f"    {target} = (", *inside, "    )"]
