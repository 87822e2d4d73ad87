"""Splitting an expression into tokens; a number takes its unit with it.

The rule for units: right after a number, words that name units, and the ``* · /`` and powers
between them, belong to the number, for as long as they go on. Parameters may not be called like
units, so the rule never depends on which parameters exist. ``10 N/m`` is a stiffness, ``10 N/R`` a
quotient, and ``k/10 N/m`` is ``k/(10 N/m)``: a unit binds tighter than any operator. A unit may
begin with a slash (``1/rad``) unless the number itself follows ``/`` or ``^``: ``R/2/m`` would then
read two ways, and is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robostiff.errors import InputError
from robostiff.io.suggest import Words, nearest
from robostiff.io.units import UNIT_WORDS, is_unit_word, make_quantity, read_unit
from robostiff.io.units.text import NUMBER

if TYPE_CHECKING:
    from pint import Quantity, Unit
else:
    Quantity = Unit = object

LONGEST_TEXT = 1000
_SPACE = re.compile(r"[ \t\r\n]*")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_OPERATOR = re.compile(r"\*\*|[-+*/^(),]")
_SHOWN = 60


@dataclass(frozen=True)
class Token:
    """A piece of the text: kind is ``number``, ``name``, ``end``, or the operator itself."""

    kind: str
    text: str
    column: int
    quantity: Quantity | None = None
    digits: str = ""
    unit: Unit | None = None


def error_at(
    text: str,
    column: int,
    *,
    got: object,
    expected: str,
    hint: str | None = None,
) -> InputError:
    """The complaint about one place of an expression."""
    start = max(0, min(column - 1 - _SHOWN // 2, len(text) - _SHOWN))
    shown = text[start : start + _SHOWN]
    if start > 0:
        shown = "…" + shown
    if start + _SHOWN < len(text):
        shown += "…"
    return InputError(
        f"expression {shown!r}, column {column}", got=got, expected=expected, hint=hint
    )


def tokens(text: str) -> Iterator[Token]:
    """The tokens of the text, one after the other, closed by one of kind ``end``.

    Raises
    ------
    InputError
        At a character that has no place in an expression, or a unit that is none.
    """
    if not isinstance(text, str):
        raise InputError("expression", got=text, expected="a text such as 2*R")
    if len(text) > LONGEST_TEXT:
        raise InputError(
            "expression",
            got=Words(f"{len(text)} characters"),
            expected=f"at most {LONGEST_TEXT}",
            hint="split it over several parameters",
        )
    start, previous, leading_slash = _skip_space(text, 0), "", True
    while start < len(text):
        token, end = _token_at(text, start, leading_slash=leading_slash)
        yield token
        is_sign = token.kind in ("+", "-") and previous not in ("number", "name", ")")
        if not is_sign:  # R/-2/m is no better than R/2/m
            leading_slash = token.kind not in ("/", "^")
        start, previous = _skip_space(text, end), token.kind
    yield Token("end", "", len(text) + 1)


def _skip_space(text: str, start: int) -> int:
    found = _SPACE.match(text, start)
    return found.end() if found else start


def _token_at(text: str, start: int, *, leading_slash: bool) -> tuple[Token, int]:
    column = start + 1
    if found := NUMBER.match(text, start):
        return _number(text, found, leading_slash=leading_slash)
    if found := _NAME.match(text, start):
        return Token("name", found[0], column), found.end()
    if found := _OPERATOR.match(text, start):
        kind = "^" if found[0] == "**" else found[0]
        return Token(kind, found[0], column), found.end()
    character = text[start]
    hints = {"·": "write *", "⋅": "write *", "×": "write *", "−": "write -", "–": "write -"}
    raise error_at(
        text,
        column,
        got=character,
        expected="numbers with units, parameters, + - * / ^, functions and brackets",
        hint=hints.get(character),
    )


def _number(text: str, found: re.Match[str], *, leading_slash: bool) -> tuple[Token, int]:
    start, digits = found.start(), found[0]
    try:
        unit, end = read_unit(text, found.end(), leading_slash=leading_slash)
    except InputError as error:
        complaint = error_at(
            text, found.end() + 1, got=error.got, expected=str(error.expected), hint=error.hint
        )
        raise complaint from None
    if unit is None:
        _refuse_word_after(text, found)
    quantity = make_quantity(float(digits), unit)
    if not math.isfinite(quantity.magnitude):
        raise error_at(text, start + 1, got=text[start:end], expected="a finite number")
    return Token("number", text[start:end], start + 1, quantity, digits, unit), end


def _refuse_word_after(text: str, found: re.Match[str]) -> None:
    """A word right after a number is either a misspelt unit or a forgotten product sign."""
    start = _skip_space(text, found.end())
    word = _NAME.match(text, start)
    if word is None:
        return
    hint = f"for a product write {found[0]}*{word[0]}"
    unit = nearest(word[0], UNIT_WORDS) if len(word[0]) > 1 else None
    if unit is not None and not is_unit_word(word[0]):
        hint = f"did you mean the unit {unit}? {hint}"
    raise error_at(text, start + 1, got=word[0], expected="a unit or an operator", hint=hint)
