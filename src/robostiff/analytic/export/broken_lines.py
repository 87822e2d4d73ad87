"""Long formulas on several lines, broken by their typeset width."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any, Protocol

import sympy as sp

from robostiff.analytic.export.products import (
    differential_parts,
    is_greek,
    name_parts,
    ordered_terms,
    printed_product,
)

_SMALL = 0.7


def math_width(expression: sp.Basic) -> float:
    """Estimate the width of a typeset expression, fractions upright, in widths of a letter.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> math_width(x)
    1.0
    >>> math_width(x + y)
    4.0
    >>> math_width((x + y) / (x * y)) < math_width(x + y) + 1
    True
    """
    match expression:
        case sp.Symbol():
            width = name_width(expression.name)
        case sp.Add():
            width = sum(math_width(term) + 2 for term in expression.args) - 2
        case sp.Mul():
            width = _product_width(expression)
        case sp.Pow():
            width = _power_width(expression)
        case sp.Rational() if expression.q != 1:
            width = float(max(len(str(expression.p)), len(str(expression.q))))
        case sp.Function():
            arguments = sum(math_width(argument) + 1 for argument in expression.args)
            width = len(type(expression).__name__) + 1 + arguments
        case _:
            width = float(len(str(expression)))
    return width


def name_width(name: str) -> float:
    """Estimate the width of a typeset name, its subscripts small."""
    differential = differential_parts(name)
    if differential is not None:
        inner, by = differential
        return 1.5 + max(name_width(inner), name_width(by))
    parts = name_parts(name)
    small = sum(_word_width(word) for word in parts.subscripts) + len(parts.subscripts) / 2
    return _word_width(parts.letter) + parts.primes / 2 + _SMALL * small


def _word_width(word: str) -> float:
    return 1.0 if is_greek(word) else float(len(word))


def _product_width(expression: sp.Expr) -> float:
    product = printed_product(expression)
    above = _factors_width(product.above)
    if product.below:
        above = max(above, _factors_width(product.below)) + 0.5
    return above + product.negative


def _factors_width(factors: tuple[sp.Expr, ...]) -> float:
    if len(factors) == 1:
        return math_width(factors[0])
    total = 1.0 if not factors else 0.0
    for factor in factors:
        total += math_width(factor) + 0.2 + (2 if isinstance(factor, sp.Add) else 0)
    return total


def _power_width(power: Any) -> float:
    if power.exp.is_Rational and power.exp.is_negative:
        return _product_width(power)
    base = math_width(power.base) + (2 if power.base.is_Add or power.base.is_Mul else 0)
    if power.exp == sp.Rational(1, 2):
        return base + 1
    return base + _SMALL * math_width(power.exp)


class Breaks(Protocol):
    """Brackets and signs of a broken line in a language for formulas."""

    # brackets that may stand on different lines
    opening: str
    closing: str
    slash: str
    power: str  # what follows a closing bracket, with ``{}`` for the exponent

    def write(self, expression: Any) -> str:
        """An expression in the language."""
        ...


@dataclass(frozen=True)
class _Piece:
    text: str
    width: float


def broken_lines(expression: sp.Expr, language: Breaks, room: float) -> list[str]:
    """Write an expression on as many lines as it needs.

    The width `room` of a line is in widths of a letter; what cannot be broken may be wider.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> a, b, c, d = sp.symbols("a b c d")
    >>> plain = SimpleNamespace(write=str, opening="(", closing=")", slash="/", power="**{}")
    >>> broken_lines((a + b + c + d) / (2 * d), plain, 7)
    ['( a + b', '+ c + d )', '/ ( 2 d )']
    """
    if math_width(expression) <= room:
        return [language.write(expression)]
    lines: list[str] = []
    line, filled = "", 0.0
    for piece in _pieces(expression, language, room):
        if line and filled + piece.width > room:
            lines.append(line)
            line, filled = "", 0.0
        line = f"{line} {piece.text}" if line else piece.text
        filled += piece.width
    return [*lines, line]


def _pieces(expression: Any, language: Breaks, room: float) -> list[_Piece]:
    """The pieces of an expression that are not broken, in order."""
    width = math_width(expression)
    # A sum that fits is still broken if otherwise half of the line before it stayed empty.
    if isinstance(expression, sp.Add) and width > room / 4:
        return _sum_pieces(expression, language, room)
    if isinstance(expression, sp.Mul | sp.Pow) and width > room:
        return _product_pieces(expression, language, room)
    return [_Piece(language.write(expression), width)]


def _sum_pieces(expression: sp.Add, language: Breaks, room: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for number, term in enumerate(ordered_terms(expression)):
        first, *rest = _pieces(term, language, room)
        if number > 0:
            negative = first.text.startswith("-")
            bare = first.text[1:].lstrip() if negative else first.text
            first = _Piece(f"{'-' if negative else '+'} {bare}", first.width + 2)
        pieces += [first, *rest]
    return pieces


def _product_pieces(expression: sp.Expr, language: Breaks, room: float) -> list[_Piece]:
    product = printed_product(expression)
    alone = product.above[0] if len(product.above) == 1 else None
    if not product.below and not product.negative and alone and not _is_power_of_a_sum(alone):
        return [_Piece(language.write(expression), math_width(expression))]
    sign = [_Piece("-", 1.0)] if product.negative else []
    pieces = [*sign, *_factor_pieces(product.above, language, room)]
    if product.negative:
        pieces = [_Piece(f"-{pieces[1].text}", pieces[1].width + 1), *pieces[2:]]
    if product.below:
        below = _factor_pieces(product.below, language, room)
        if len(product.below) > 1:
            below = _bracketed(below, language)
        first = below[0]
        below[0] = _Piece(f"{language.slash} {first.text}", first.width + 1)
        pieces += below
    return pieces


def _factor_pieces(factors: tuple[Any, ...], language: Breaks, room: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for factor in factors:
        if isinstance(factor, sp.Add):
            pieces += _bracketed(_pieces(factor, language, room), language)
        elif _is_power_of_a_sum(factor) and math_width(factor) > room:
            pieces += _bracketed(_pieces(factor.base, language, room), language)
            power = language.power.replace("{}", language.write(factor.exp))
            pieces[-1] = _Piece(f"{pieces[-1].text}{power}", pieces[-1].width + 1)
        else:
            pieces += _pieces(factor, language, room)
    return pieces or [_Piece("1", 1.0)]


def _is_power_of_a_sum(factor: Any) -> bool:
    return factor.is_Pow and factor.base.is_Add and factor.exp.is_Integer and factor.exp > 1


def _bracketed(pieces: list[_Piece], language: Breaks) -> list[_Piece]:
    pieces = list(pieces)
    pieces[0] = _Piece(f"{language.opening} {pieces[0].text}", pieces[0].width + 1)
    pieces[-1] = _Piece(f"{pieces[-1].text} {language.closing}", pieces[-1].width + 1)
    return pieces


_BEFORE_SIGN_OR_AFTER_COMMA = re.compile(r"(?<= )(?=[+-] )|(?<=, )|(?<=\)/)")
_AFTER_TIMES_OR_OVER = re.compile(r"(?<=[^*]\*)(?=[^*])|(?<=/)")


def wrapped_formula(text: str, width: int, first: str = "", rest: str = "    ") -> list[str]:
    """Break a formula before ``+`` and ``-``, and inside a term only where it is too long.

    `first` and `rest` stand before the first line and before the others, inside the `width`. What
    cannot be broken may be longer.

    Examples
    --------
    >>> wrapped_formula("alpha + beta*gamma - delta", 16, "x = ")
    ['x = alpha', '    + beta*gamma', '    - delta']
    """
    tokens = _tokens(text, width - max(len(first), len(rest)))
    lines: list[str] = []
    line, started = first, False
    for token in tokens:
        if started and len((line + token).rstrip()) > width:
            lines.append(line.rstrip())
            line = rest
        line, started = line + token, True
    return [*lines, line.rstrip()]


def _tokens(text: str, room: int) -> list[str]:
    """Pieces that stay together: sums are broken between brackets before they are broken inside."""
    depths = [0, *accumulate((x == "(") - (x == ")") for x in text)]  # of brackets
    places = [m.start() for m in _BEFORE_SIGN_OR_AFTER_COMMA.finditer(text)]
    cuts = [0, len(text)]
    for depth in range(max(depths) + 1):
        at_depth = [place for place in places if depths[place] == depth]
        cuts = _cut_where_long(cuts, at_depth, room)
    at_factors = [m.start() for m in _AFTER_TIMES_OR_OVER.finditer(text)]
    cuts = _cut_where_long(cuts, at_factors, room)
    return [text[start:stop] for start, stop in pairwise(cuts)]


def _cut_where_long(cuts: list[int], places: list[int], room: int) -> list[int]:
    """More cuts, inside the pieces that are longer than a line."""
    added = [
        place
        for start, stop in pairwise(cuts)
        if stop - start > room
        for place in places
        if start < place < stop
    ]
    return sorted({*cuts, *added})


def wrapped_words(text: str, width: int, rest: str = "") -> list[str]:
    """Break a sentence at blanks.

    Examples
    --------
    >>> wrapped_words("one two three", 8, "  ")
    ['one two', '  three']
    """
    return textwrap.wrap(
        text, width, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False
    )
