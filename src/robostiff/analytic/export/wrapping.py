"""Long lines of text and of formulas, wrapped."""

from __future__ import annotations

import re
import textwrap
from itertools import accumulate, pairwise

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
    depths = _depths(text)
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


def _depths(text: str) -> list[int]:
    """How many brackets are open before each character, and at the end."""
    changes = ((character == "(") - (character == ")") for character in text)
    return [0, *accumulate(changes)]


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
