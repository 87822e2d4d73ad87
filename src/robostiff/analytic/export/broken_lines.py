"""Long formulas over several lines, broken at their plus signs and between factors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from robostiff.analytic.export.math_width import math_width
from robostiff.analytic.export.products import printed_product


@dataclass(frozen=True)
class Breaks:
    """What a language for formulas calls the pieces of a broken line.

    Attributes
    ----------
    write : callable
        An expression in the language.
    opening, closing : str
        Brackets that may stand on different lines.
    slash : str
    power : str
        What follows a closing bracket, with ``{}`` for the exponent.
    """

    write: Callable[[sp.Expr], str]
    opening: str
    closing: str
    slash: str
    power: str


@dataclass(frozen=True)
class _Piece:
    text: str
    width: float


def broken_lines(expression: sp.Expr, language: Breaks, room: float) -> list[str]:
    """Write an expression on as many lines as it needs.

    Parameters
    ----------
    expression : SymPy expression
    language : Breaks
    room : float
        Width of a line in widths of a letter. What cannot be broken may be wider.

    Examples
    --------
    >>> a, b, c, d = sp.symbols("a b c d")
    >>> plain = Breaks(str, "(", ")", "/", "**{}")
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
    """What must stay together, in order."""
    width = math_width(expression)
    # A sum that fits may still be broken, lest half of the line before it stay empty.
    if isinstance(expression, sp.Add) and width > room / 4:
        return _sum_pieces(expression, language, room)
    if isinstance(expression, sp.Mul | sp.Pow) and width > room:
        return _product_pieces(expression, language, room)
    return [_Piece(language.write(expression), width)]


def _sum_pieces(expression: sp.Add, language: Breaks, room: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for number, term in enumerate(expression.as_ordered_terms()):
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
