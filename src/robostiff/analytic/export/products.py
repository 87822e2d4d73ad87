"""Expressions as they are printed: products as fractions, and what all typeset formulas share."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class PrintedProduct:
    """A product or quotient, its factors in the order of printing."""

    negative: bool
    # factors without a sign; empty stands for 1
    above: tuple[sp.Expr, ...]
    below: tuple[sp.Expr, ...]


def printed_product(expression: sp.Expr) -> PrintedProduct:
    """Take a product apart without evaluating it.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> printed_product(-2 * x / (3 * y**2))
    PrintedProduct(negative=True, above=(2, x), below=(3, y**2))
    """
    negative = False
    above: list[sp.Expr] = []
    below: list[sp.Expr] = []
    numbers: tuple[list[sp.Expr], list[sp.Expr]] = ([], [])
    for factor in expression.as_ordered_factors():
        if isinstance(factor, sp.Rational):
            negative ^= bool(factor < 0)
            numbers[0].append(sp.Integer(abs(int(factor.p))))
            numbers[1].append(sp.Integer(int(factor.q)))
        elif isinstance(factor, sp.Float):
            negative ^= bool(factor < 0)
            numbers[0].append(abs(factor))
        elif isinstance(factor, sp.Pow) and factor.exp.is_Rational and factor.exp.is_negative:
            power = factor.base if factor.exp == -1 else sp.Pow(factor.base, -factor.exp)
            below.append(power)
        else:
            above.append(factor)
    return PrintedProduct(
        negative,
        (*(n for n in numbers[0] if n != 1), *above),
        (*(n for n in numbers[1] if n != 1), *below),
    )


def number_in_front(product: Any) -> tuple[sp.Expr, Any]:
    """A fraction before a bracket that has fractions in it, and the rest; None where it has none.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> number_in_front(3 * y * (1 / x + y) / 2), number_in_front(x / 2)
    ((3/2, y*(y + 1/x)), (1, None))
    """
    number, rest = product.as_coeff_Mul()
    terms = [term for factor in sp.Mul.make_args(rest) if factor.is_Add for term in factor.args]
    is_before = number.is_Rational and not number.is_Integer
    if not is_before or all(sp.denom(x).is_number for x in terms) or sp.denom(rest) != 1:
        return sp.Integer(1), None
    return number, rest


#: Digits of a decimal in print.
DIGITS = 12
_BITS = sp.Float(1, DIGITS)._prec


def decimal(number: sp.Float) -> str:
    """A decimal as it is printed, without zeros at its end: 0.333333333333, 1.5e-9.

    Examples
    --------
    >>> decimal(sp.Float(1 / 3)), decimal(sp.Float(0.64)), decimal(sp.Float("0.1", 3))
    ('0.333333333333', '0.64', '0.1')
    """
    is_long = number._prec > _BITS
    return sp.sstr(sp.Float(number, DIGITS) if is_long else number, full_prec=False)


def ordered_terms(expression: Any) -> list[Any]:
    """Terms of a sum as SymPy orders them, a positive one in front where there is one."""
    terms = list(expression.as_ordered_terms())
    plain = (i for i, x in enumerate(terms) if not x.as_coeff_Mul()[0].is_negative)
    first = next(plain, 0)
    return [terms[first], *terms[:first], *terms[first + 1 :]]


def joined_terms(terms: Iterable[str], minus: str = " - ", plus: str = " + ") -> str:
    """Written terms as a sum."""
    first, *others = terms
    return first + "".join(f"{minus}{t[1:]}" if t.startswith("-") else f"{plus}{t}" for t in others)


_GREEK_NAMES = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma "
    "tau upsilon phi chi psi omega"
)
#: Greek letters by their English names.
GREEK: dict[str, str] = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξοπρστυφχψω", strict=True))
_NAMES_OF_GREEK = {letter: name for name, letter in GREEK.items()}
_GREEK_CAPITALS = {
    name.capitalize(): name.capitalize()
    for name in ("gamma", "delta", "theta", "lambda", "xi", "pi", "sigma", "phi", "psi", "omega")
}


@dataclass(frozen=True)
class NameParts:
    """A letter or word with its subscripts."""

    letter: str  # a letter, a word, or the English name of a Greek letter
    subscripts: tuple[str, ...] = ()  # likewise, from left to right
    primes: int = 0  # how many primes follow the letter


_COORDINATE = re.compile("i(j?[xyz]|j)")


def name_parts(name: str) -> NameParts:
    """Take a name apart at underscores, commas and trailing digits."""
    pieces = [piece for piece in re.split(r"[_,\s{}^]+", name) if piece]
    if not pieces:
        return NameParts(name)
    head, subscripts = pieces[0], pieces[1:]
    stripped = head.rstrip("'′")
    primes = len(head) - len(stripped)
    matched = re.fullmatch(r"(\D+?)(\d+)", stripped)
    if matched:
        stripped, subscripts = matched[1], [matched[2], *subscripts]
    # Of a coordinate of leg i, or of its rod j.
    subscripts = [part for s in subscripts for part in (s if _COORDINATE.fullmatch(s) else (s,))]
    return NameParts(_spelled(stripped or head), tuple(map(_spelled, subscripts)), primes)


def differential_parts(name: str) -> tuple[str, str] | None:
    """Numerator and denominator of derivative names such as dK_1_11_dR; None for other names."""
    matched = re.fullmatch(r"d([A-Za-z][^,\s]*)_d([A-Za-z].*)", name)
    return (matched[1], matched[2]) if matched else None


def is_greek(word: str) -> bool:
    """Whether a word is the English name of a Greek letter."""
    return word in GREEK or word in _GREEK_CAPITALS


def is_word(name: str) -> bool:
    """Whether a name begins with a word, which is set apart from what stands beside it."""
    letter = name_parts(name).letter
    return len(letter) > 1 and not is_greek(letter)


def _spelled(word: str) -> str:
    """A Greek character by its English name; other characters unchanged."""
    if len(word) != 1:
        return word
    if word in _NAMES_OF_GREEK:
        return _NAMES_OF_GREEK[word]
    lower = word.lower()
    if lower in _NAMES_OF_GREEK and _NAMES_OF_GREEK[lower].capitalize() in _GREEK_CAPITALS:
        return _NAMES_OF_GREEK[lower].capitalize()
    return word
