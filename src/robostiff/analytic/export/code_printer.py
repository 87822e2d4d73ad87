"""Expressions and the names of their symbols in a programming language."""

from __future__ import annotations

import re
import unicodedata
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

from robostiff.analytic.export.products import printed_product
from robostiff.analytic.export.scaled import LARGE
from robostiff.analytic.export.vocabulary import constant_name, function_name, unknown
from robostiff.errors import InputError

_LARGEST = sp.Integer(10) ** 300
_HALF = sp.Rational(1, 2)
_NUMBERS = 8  # letters for a number behind an identifier


class CodePrinter(ABC):
    """Writes expressions of the vocabulary with ``+ - * /``; subclasses add the rest of a language.

    Parameters
    ----------
    names : mapping of sympy.Symbol to str
        Identifiers of the symbols.
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
        written = ""
        for term in expression.as_ordered_terms():
            text = self.write(term)
            if not written:
                written = text
            elif text.startswith("-"):
                written += f" - {text[1:]}"
            else:
                written += f" + {text}"
        return written

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


class Identifiers:
    """Unique identifiers that are not reserved in the language.

    Parameters
    ----------
    reserved : iterable of str
        Keywords and names that are not to be hidden.
    longest : int, optional
        Most letters of an identifier.

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
    """Letters, digits and underscores, a letter first; Greek letters by their names.

    Examples
    --------
    >>> [ascii_identifier(name) for name in ("Δx'", "__x", "é", "")]
    ['Deltax_', 'v__x', 'e', 'v']
    """
    spelled = "".join(map(_spelled, unicodedata.normalize("NFKD", name)))
    plain = re.sub(r"[^A-Za-z0-9_]", "_", spelled)
    return plain if plain[:1].isalpha() else f"v{plain}"


def _spelled(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.combining(character):
        return ""
    matched = re.fullmatch(r"GREEK (SMALL|CAPITAL) LETTER (FINAL )?(\w+)", _unicode_name(character))
    if matched is None:
        return "_"
    letter = "lambda" if matched[3] == "LAMDA" else matched[3].lower()
    return letter if matched[1] == "SMALL" else letter.capitalize()


def _unicode_name(character: str) -> str:
    return unicodedata.name(character, "")
