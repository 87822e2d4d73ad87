"""What generated functions share, whatever their language: expressions, names, tests, words."""

from __future__ import annotations

import re
import unicodedata
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Derivation
from robostiff.analytic.derivatives import FormulaDerivative
from robostiff.analytic.export.broken_lines import wrapped_formula
from robostiff.analytic.export.products import joined_terms, printed_product
from robostiff.analytic.export.program import LARGE, FormulaProgram
from robostiff.analytic.export.vocabulary import constant_name, function_name, unknown
from robostiff.errors import InputError
from robostiff.spatial import Space

_LARGEST = sp.Integer(10) ** 300
_HALF = sp.Rational(1, 2)
_NUMBERS = 8  # letters for a number behind an identifier


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


class CaretPrinter(CodePrinter):
    """What Julia and MATLAB have in common."""

    def integer(self, value: int) -> str:
        """A double where it is no exact integer."""
        return str(value) if value <= LARGEST_EXACT else repr(float(value))

    def constant(self, name: str) -> str:
        """Pi or e."""
        return {"pi": "pi", "e": "exp(1)"}[name]

    def power(self, base: Any, exponent: Any) -> str:
        """With a caret."""
        written = self.factor(base)
        return f"{f'({written})' if base.is_Pow else written}^{self.factor(exponent)}"


class Identifiers:
    """Unique identifiers that are not reserved in the language.

    `reserved`: keywords and names that are not to be hidden; `longest`: most letters of an
    identifier.

    Examples
    --------
    >>> names = Identifiers({"lambda"})
    >>> [names.take(name) for name in ("lambda", "K_C,1", "K_C_1", "φ", "2a", "λ")]
    ['lambda_', 'K_C_1', 'K_C_1_2', 'phi', 'v2a', 'lambda_2']
    """

    def __init__(self, reserved: Iterable[str], longest: int | None = None) -> None:
        self._reserved = frozenset(reserved)
        self._longest = longest
        self._taken: set[str] = set()

    def take(self, name: str) -> str:
        """An identifier like a name."""
        plain = ascii_identifier(name)
        if self._longest is not None:
            plain = plain[: self._longest - _NUMBERS]
        if plain in self._reserved:
            plain = f"{plain}_"
        identifier, number = plain, 2
        while identifier in self._taken or identifier in self._reserved:
            identifier = f"{plain.rstrip('_')}_{number}"
            number += 1
        self._taken.add(identifier)
        return identifier


def ascii_identifier(name: str) -> str:
    """Letters, digits and underscores, a letter first; Greek letters by their names."""
    spelled = "".join(map(_spelled, unicodedata.normalize("NFKD", name)))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", spelled)
    return plain if plain[:1].isalpha() else f"v{plain}"


def _spelled(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.combining(character):
        return ""
    matched = re.fullmatch(
        r"GREEK (SMALL|CAPITAL) LETTER (FINAL )?(\w+)", unicodedata.name(character, "")
    )
    if matched is None:
        return "_"
    letter = "lambda" if matched[3] == "LAMDA" else matched[3].lower()
    return letter if matched[1] == "SMALL" else letter.capitalize()


#: Integers up to this one are doubles.
LARGEST_EXACT = 2**53

#: Message of a generated function for one point.
NO_ANSWER = "the formula does not hold at these values"


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


def arguments_in_words(
    compute: FormulaProgram, written: Iterable[str], start: str = "", end: str = ""
) -> list[str]:
    """Lines of a comment on the arguments of which something is known."""
    each = zip(written, compute.arguments, strict=True)
    about = [(x, about_argument(x, symbol, compute.meanings)) for x, symbol in each]
    return [f"{start}{x}{end}: {words}" for x, words in about if words]


def title_of_function(derivation: Derivation | FormulaDerivative) -> str:
    """What a generated function computes, in words, for a string of Python."""
    if isinstance(derivation, FormulaDerivative):
        name, symbol = derivation.derivation.name, derivation.symbol.name
        return f"{unquoted(name)} with its derivative by {unquoted(symbol)}"
    return unquoted(derivation.name)


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


def checks_of(
    compute: FormulaProgram, write: Callable[[sp.Expr], str], size: str = "abs", zero: str = "0"
) -> list[str]:
    """Tests that sums do not cancel and conditions hold; `size` writes absolute values."""
    tests = []
    for guard in compute.guards:
        sizes = " + ".join(f"{size}({write(term)})" for term in guard.terms)
        tests.append(f"{size}({write(guard.value)}) > {guard.part}*({sizes})")
    return [*tests, *(f"{write(x)} {sign} {zero}" for _, x, sign in compute.conditions)]


def assigned(target: str, expression: str, width: int) -> list[str]:
    """An assignment, in brackets where it takes more than a line: of Python and of Julia."""
    line = f"    {target} = {expression}"
    if len(line) <= width:
        return [line]
    inside = wrapped_formula(expression, width, " " * 8, " " * 8)
    return [f"    {target} = (", *inside, "    )"]


def named_symbols(compute: FormulaProgram, identifiers: Identifiers) -> dict[sp.Symbol, str]:
    """Identifiers of the arguments and intermediates of a program."""
    symbols = (*compute.arguments, *(a.symbol for a in compute.assignments))
    return {symbol: identifiers.take(symbol.name) for symbol in symbols}


def tests_after(
    holds: str, finite: str, compute: FormulaProgram, write: Callable[[sp.Expr], str]
) -> list[str]:
    """What is assigned to the flag `holds`, one test after the other, in languages with ``&&``.

    The first test, `finite`, is that arguments and results are; `write` writes an expression.
    """
    return [finite, *(f"{holds} && {test}" for test in checks_of(compute, write))]
