"""What generated functions share, whatever their language: expressions, lines, words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula
from robostiff.analytic.export.products import joined_terms, printed_product
from robostiff.analytic.export.program import LARGE, FormulaProgram, Guard, program
from robostiff.analytic.export.vocabulary import (
    Identifiers,
    ascii_identifier,
    constant_name,
    function_name,
    unknown,
)
from robostiff.errors import InputError
from robostiff.spatial import Space

#: Integers up to this one are doubles.
LARGEST_EXACT = 2**53

_LARGEST = sp.Integer(10) ** 300
_WIDTH = 96
_HALF = sp.Rational(1, 2)


class CodePrinter(ABC):
    """Writes expressions of the vocabulary with ``+ - * /``; subclasses add the rest of a language.

    `names`: identifiers of the symbols.
    """

    def __init__(self, names: Mapping[sp.Symbol, str]) -> None:
        self._names = names

    @abstractmethod
    def integer(self, value: int) -> str:
        """A number without a sign."""

    @abstractmethod
    def call(self, function: str, arguments: list[str]) -> str:
        """A function of the vocabulary, or sqrt."""

    @abstractmethod
    def constant(self, name: str) -> str:
        """A constant of the vocabulary."""

    @abstractmethod
    def power(self, base: Any, exponent: Any) -> str:
        """A power with a positive exponent, fit to be a factor."""

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


def plain_text(name: str) -> str:
    """A name inside a comment or a string: printable, without quotes and signs of comments."""
    kept = "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"*\\?%$`#')
    return " ".join(kept.split()) or "without a plain name"


def about_argument(
    written: str,
    symbol: sp.Symbol,
    meanings: Mapping[str, str],
    plain: Callable[[str], str] = plain_text,
) -> str:
    """What a comment says of an argument: its name in the formula where it has another, and more.

    `plain` makes a name fit for the comment.
    """
    own = [] if written == symbol.name else [f"{plain(symbol.name)} of the formula"]
    meaning = meanings.get(symbol.name)
    return ", ".join([*own, plain(meaning)] if meaning else own)


def convention(size: int) -> str:
    """Order, point and units of a stiffness matrix of a size, in words."""
    space = Space.of_size(size)
    return (
        f"relates the twist ({', '.join(space.twist_order)}) of the reference point to the "
        f"wrench ({', '.join(space.wrench_order)}) about the reference point, F = K t: "
        "translation before rotation, force before moment, SI units."
    )


def where_it_holds(compute: FormulaProgram) -> str:
    """The arguments for which a generated function gives no answer, in words."""
    words = (
        "where the formula does not hold: where a denominator vanishes up to rounding, "
        "a radicand is negative, or a given value or K is not finite"
    )
    besides = dict.fromkeys(unquoted(own) for own, *_ in compute.conditions)
    return words + "".join(f"; unless {own}" for own in besides)


def unquoted(name: str) -> str:
    """A name inside a string or a comment of Python."""
    kept = "".join(c for c in name if c.isprintable() and c not in '"\\')
    return " ".join(kept.split())


def filled(
    matrix: sp.ImmutableMatrix, place: Callable[[int, int], str], write: Callable[[sp.Expr], str]
) -> Iterator[tuple[str, str]]:
    """Targets and right-hand sides for the entries of a matrix of zeros that are not zero.

    `place` writes the entry in row i and column j, from 0; `write` writes an expression.
    """
    K_rows = matrix.tolist()
    for i, row in enumerate(K_rows):
        for j, entry in enumerate(row):
            if entry == 0:
                continue
            copied = j < i and entry == K_rows[j][i]
            yield place(i, j), place(j, i) if copied else write(entry)


def margins_of(
    compute: FormulaProgram, write: Callable[[sp.Expr], str], size: str = "abs"
) -> list[str]:
    """What is positive where the formula holds, or not negative, in the order of `checks_of`."""
    margins = [
        f"{size}({write(guard.value)}) - {guard.part}*({_sizes(guard, write, size)})"
        for guard in compute.guards
    ]
    return [*margins, *(write(x) for _, x, _ in compute.conditions)]


def checks_of(
    compute: FormulaProgram, write: Callable[[sp.Expr], str], size: str, zero: str
) -> list[str]:
    """Tests that sums do not cancel and conditions hold; `size` writes absolute values."""
    tests = [
        f"{size}({write(guard.value)}) > {guard.part}*({_sizes(guard, write, size)})"
        for guard in compute.guards
    ]
    return [*tests, *(f"{write(x)} {sign} {zero}" for _, x, sign in compute.conditions)]


def _sizes(guard: Guard, write: Callable[[sp.Expr], str], size: str) -> str:
    return " + ".join(f"{size}({write(term)})" for term in guard.terms)


class Code(CodePrinter):
    """A program in a language: its expressions, and the lines of a function."""

    language: ClassVar[str]
    words: ClassVar[frozenset[str]]  # identifiers that must not be defined
    longest: ClassVar[int | None] = None  # letters of an identifier
    width: ClassVar[int] = _WIDTH
    size: ClassVar[str] = "abs"
    zero: ClassVar[str] = "0"

    def __init__(
        self, derivation: Derivation | FormulaDerivative | FormulaProgram, name: str
    ) -> None:
        is_identifier = ascii_identifier(name) == name and len(name) <= (self.longest or len(name))
        if not is_identifier or name in self.words:
            expected = f"an identifier of {self.language}"
            raise InputError("name of the function", got=name, expected=expected)
        self.name, self.of = name, derivation
        is_program = isinstance(derivation, FormulaProgram)
        self.compute = compute = derivation if is_program else program(derivation)
        self.identifiers = Identifiers({*self.words, name}, self.longest)
        take = self.identifiers.take
        symbols = (*compute.arguments, *(a.symbol for a in compute.assignments))
        super().__init__({symbol: take(symbol.name) for symbol in symbols})
        self.arguments = [self._names[symbol] for symbol in compute.arguments]
        self.results = [take(x) for x in ("K", "dK")[: len(compute.results)]]
        self.holds = take("holds")
        self.prepare()

    def prepare(self) -> None:
        """Identifiers of the language's own."""

    @property
    def title(self) -> str:
        """What the function computes, in words."""
        if isinstance(self.of, FormulaDerivative):
            return f"{self.of.derivation.name} with its derivative by {self.of.symbol.name}"
        return getattr(self.of, "name", "")

    @property
    def conditions(self) -> str:
        """Where there is no answer, in words."""
        return plain_text(where_it_holds(self.compute))

    def known_arguments(self, start: str = "", end: str = "") -> list[str]:
        """Lines of a comment on the arguments of which something is known."""
        each = zip(self.arguments, self.compute.arguments, strict=True)
        about = [(x, about_argument(x, symbol, self.compute.meanings)) for x, symbol in each]
        return [f"{start}{x}{end}: {words}" for x, words in about if words]

    def source(self) -> str:
        """All of it."""
        tests = checks_of(self.compute, self.write, self.size, self.zero)
        both = [x for test in tests for x in self.assigned(self.holds, self.both(test))]
        return "\n".join([*self.beginning(), *self.steps(), *self.finite(), *both, *self.end(), ""])

    def steps(self) -> list[str]:
        """Lines that compute intermediates and matrices."""
        lines: list[str] = []
        for a in self.compute.assignments:
            lines += self.assigned(self.declared(self._names[a.symbol]), self.write(a.expression))
        for K, matrix in zip(self.results, self.compute.results, strict=True):
            n = matrix.rows
            lines += self.zeros(K, n)
            place: Callable[[int, int], str] = lambda i, j, K=K, n=n: self.place(K, i, j, n)  # noqa: E731
            for target, expression in filled(matrix, place, self.write):
                lines += self.assigned(target, expression)
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
