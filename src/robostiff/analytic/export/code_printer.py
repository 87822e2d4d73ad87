"""What generated functions share, whatever their language: expressions, lines, words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
import sympy as sp

from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula, wrapped_words
from robostiff.analytic.export.products import joined_terms, printed_product
from robostiff.analytic.export.program import LARGE, FormulaProgram, program
from robostiff.analytic.export.vocabulary import (
    Identifiers,
    ascii_identifier,
    constant_name,
    function_name,
    unknown,
)
from robostiff.errors import InputError
from robostiff.spatial import Space

#: Message of a generated function for one point.
NO_ANSWER = "the formula does not hold at these values"

_LARGEST = sp.Integer(10) ** 300
_HALF = sp.Rational(1, 2)
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


class Code(ABC):
    """A program in a language: its expressions with ``+ - * /``, and the lines of a function.

    Subclasses add how the language writes numbers, functions, powers, matrices and refusals.
    """

    language: ClassVar[str]
    words: ClassVar[frozenset[str]]  # identifiers that must not be defined
    longest: ClassVar[int | None] = None  # letters of an identifier
    width: ClassVar[int] = 96
    size: ClassVar[str] = "abs"
    zero: ClassVar[str] = "0"

    name: str
    title: str
    compute: FormulaProgram
    identifiers: Identifiers
    arguments: list[str]
    results: list[str]
    holds: str

    def __init__(self, derivation: Any, name: str) -> None:
        is_identifier = ascii_identifier(name) == name and len(name) <= (self.longest or len(name))
        if not is_identifier or name in self.words:
            expected = f"an identifier of {self.language}"
            raise InputError("name of the function", got=name, expected=expected)
        self.name, self.title = name, getattr(derivation, "name", "")
        if isinstance(derivation, FormulaDerivative):
            whole, symbol = derivation.derivation.name, derivation.symbol.name
            self.title = f"{whole} with its derivative by {symbol}"
        is_program = isinstance(derivation, FormulaProgram)
        self.compute = compute = derivation if is_program else program(derivation)
        self.identifiers = Identifiers({*self.words, name}, self.longest)
        take = self.identifiers.take
        symbols = (*compute.arguments, *(a.symbol for a in compute.assignments))
        self._names = {symbol: take(symbol.name) for symbol in symbols}
        self.arguments = [self._names[symbol] for symbol in compute.arguments]
        self.results = [take(x) for x in ("K", "dK")[: len(compute.results)]]
        self.holds = take("holds")

    def integer(self, value: int) -> str:
        """A number without a sign; a double where that is no exact integer."""
        return str(value) if value <= 2**53 else repr(float(value))

    @abstractmethod
    def call(self, function: str, arguments: list[str]) -> str:
        """A function of the vocabulary, or sqrt."""

    def constant(self, name: str) -> str:
        """A constant of the vocabulary."""
        return {"pi": "pi", "e": "exp(1)"}[name]

    def power(self, base: Any, exponent: Any, sign: str = "^") -> str:
        """A power with a positive exponent, fit to be a factor."""
        written = self.factor(base)
        return f"{f'({written})' if base.is_Pow else written}{sign}{self.factor(exponent)}"

    def write(self, expression: Any) -> str:
        """An expression as a statement's right-hand side."""
        if not isinstance(expression, sp.Add):
            return self._product(expression)
        return joined_terms(map(self.write, expression.as_ordered_terms()))

    def factor(self, expression: Any) -> str:
        """An expression in brackets where it needs them beside ``*``, ``/`` and in a power."""
        if isinstance(expression, sp.Symbol):
            return self._names[expression]
        if isinstance(expression, sp.Integer | sp.Float) and expression >= 0:
            return self._number(expression)
        if isinstance(expression, sp.Pow) and expression.exp.is_positive:
            if expression.exp == _HALF:
                return self.call("sqrt", [self.write(expression.base)])
            return self.power(expression.base, expression.exp)
        if isinstance(expression, sp.Add | sp.Mul | sp.Pow | sp.Number):
            return f"({self.write(expression)})"
        return self._named(expression)

    def _named(self, expression: sp.Expr) -> str:
        constant, function = constant_name(expression), function_name(expression)
        if constant is not None:
            return self.constant(constant)
        if function is not None:
            return self.call(function, [self.write(argument) for argument in expression.args])
        raise unknown(expression)

    def _product(self, expression: sp.Expr) -> str:
        if isinstance(expression, sp.Rational):
            return self._rational(expression)
        product = printed_product(expression)
        above, below = list(product.above), list(product.below)
        written = []
        if below and isinstance(below[0], sp.Integer) and len(above) + len(below) > 1:
            denominator = below.pop(0)
            numerator = above.pop(0) if above and above[0].is_Integer else sp.Integer(1)
            written.append(f"({self._rational(sp.Rational(numerator, denominator))})")
        written += [self.factor(factor) for factor in above]
        text = "*".join(written) or self.integer(1)
        if below:
            divisor = "*".join(self.factor(factor) for factor in below)
            text += f"/{divisor}" if len(below) == 1 else f"/({divisor})"
        return f"-{text}" if product.negative else text

    def _rational(self, number: Any) -> str:
        sign = "-" if number < 0 else ""
        if abs(number.p) > LARGE or number.q > LARGE:
            return sign + self._float(abs(number))
        numerator = self._number(sp.Integer(abs(int(number.p))))
        if number.q == 1:
            return sign + numerator
        return f"{sign}{numerator}/{self._number(sp.Integer(int(number.q)))}"

    def _number(self, number: Any) -> str:
        if number.is_Integer and number <= LARGE:
            return self.integer(int(number))
        return self._float(number)

    def _float(self, number: Any) -> str:
        """The double that is nearest to a number without a sign."""
        if number > _LARGEST or 0 < number < 1 / _LARGEST:
            raise InputError("number", got=str(number), expected="one that is a double")
        return repr(float(number))

    @staticmethod
    def plain(name: str) -> str:
        """A name fit for a comment of the language."""
        return plain_text(name)

    def about(self, written: str, symbol: Any) -> str:
        """What a comment says of an argument: its name in the formula, its meaning."""
        own = [] if written == symbol.name else [f"{self.plain(symbol.name)} of the formula"]
        meaning = self.compute.meanings.get(symbol.name)
        return ", ".join([*own, self.plain(meaning)] if meaning else own)

    def of_arguments(self) -> list[str]:
        """Lines of the comment on the arguments of which something is known."""
        each = zip(self.arguments, self.compute.arguments, strict=True)
        about = [(x, self.about(x, symbol)) for x, symbol in each]
        return [f"{x}: {words}" for x, words in about if words]

    def comment(self, subject: str, fails: str, indent: int = 0, shape: str = "") -> list[str]:
        """Lines on the matrix, what it relates, its arguments, and where there is no answer."""
        n, width = self.compute.entries.rows, self.width - indent
        space, of = Space.of_size(n), self.of_arguments()
        title = f"Stiffness matrix {self.plain(self.title)} about the reference point, "
        convention = (
            f"relates the twist ({', '.join(space.twist_order)}) of the reference point to the "
            f"wrench ({', '.join(space.wrench_order)}) about the reference point, F = K t: "
            "translation before rotation, force before moment, SI units."
        )
        beside = dict.fromkeys(unquoted(own) for own, *_ in self.compute.conditions)
        where = self.plain(_FAILS + "".join(f"; unless {own}" for own in beside))
        return [
            *(*wrapped_words(f"{title}{shape or f'{n} x {n}'}.", width), ""),
            *(*wrapped_words(f"{subject} {convention}", width), ""),
            *(*of, *[""][: len(of)]),
            *wrapped_words(f"{fails} {where}.", width),
        ]

    def source(self) -> str:
        """All of it."""
        conditions = self.compute.conditions
        tests = [f"{size} > {least}" for size, least in self._guarded()]
        tests += [f"{self.write(x)} {sign} {self.zero}" for _, x, sign in conditions]
        both = [x for test in tests for x in self.assigned(self.holds, self.both(test))]
        return "\n".join([*self.beginning(), *self.steps(), *self.finite(), *both, *self.end(), ""])

    def margins(self) -> list[str]:
        """What is positive where the formula holds, or not negative, in the order of its tests."""
        margins = [f"{size} - {least}" for size, least in self._guarded()]
        return [*margins, *(self.write(x) for _, x, _ in self.compute.conditions)]

    def _guarded(self) -> Iterator[tuple[str, str]]:
        """Sizes of sums that must not cancel, and the least that they may be."""
        for guard in self.compute.guards:
            whole, *terms = (f"{self.size}({self.write(x)})" for x in (guard.value, *guard.terms))
            yield whole, f"{guard.part}*({' + '.join(terms)})"

    def steps(self) -> list[str]:
        """Lines that compute intermediates and matrices."""
        lines: list[str] = []
        for a in self.compute.assignments:
            lines += self.assigned(self.declared(self._names[a.symbol]), self.write(a.expression))
        for K, matrix in zip(self.results, self.compute.results, strict=True):
            n, rows = matrix.rows, matrix.tolist()
            lines += self.zeros(K, n)
            for i, j in (place for place in np.ndindex(n, n) if rows[place[0]][place[1]] != 0):
                is_copy = j < i and rows[i][j] == rows[j][i]
                written = self.place(K, j, i, n) if is_copy else self.write(rows[i][j])
                lines += self.assigned(self.place(K, i, j, n), written)
        return lines

    def assigned(self, target: str, expression: str) -> list[str]:
        """An assignment, in brackets where it takes more than a line: of Python and of Julia."""
        line = f"    {target} = {expression}"
        if len(line) <= self.width:
            return [line]
        inside = wrapped_formula(expression, self.width, " " * 8, " " * 8)
        return [f"    {target} = (", *inside, "    )"]

    def declared(self, name: str) -> str:
        """The target of an intermediate."""
        return name

    def both(self, test: str) -> str:
        """What holds before, and a test."""
        return f"{self.holds} && {test}"

    @abstractmethod
    def place(self, K: str, i: int, j: int, n: int) -> str:
        """The entry of a matrix (n x n) in row i and column j, from 0."""

    @abstractmethod
    def zeros(self, K: str, n: int) -> list[str]:
        """Lines that make a matrix of zeros."""

    @abstractmethod
    def beginning(self) -> list[str]:
        """Comment, and head of the function."""

    @abstractmethod
    def finite(self) -> list[str]:
        """Lines that find whether arguments and results are finite."""

    @abstractmethod
    def end(self) -> list[str]:
        """Lines that return the matrices, or refuse."""
