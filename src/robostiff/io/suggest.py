"""Words for messages: the nearest allowed word, and lists of allowed words."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from itertools import islice

_LONGEST_WORD = 60
_MOST_CANDIDATES = 1000


class Words(str):
    """Text that a message shows without quotes.

    Examples
    --------
    >>> Words("5 numbers")
    5 numbers
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that is most similar to `word`, or None if none is similar.

    Examples
    --------
    >>> nearest("prismatc", ["revolute", "prismatic"])
    'prismatic'
    >>> nearest("MM", ["m", "mm"])
    'mm'
    """
    candidates = list(islice(allowed, _MOST_CANDIDATES))
    if len(word) > _LONGEST_WORD:
        return None
    for candidate in candidates:
        if candidate.casefold() == word.casefold():
            return candidate
    close = difflib.get_close_matches(word, candidates, n=1)
    return close[0] if close else None


def nearest_first(word: str, allowed: Sequence[str]) -> list[str]:
    """The allowed words, the one most similar to `word` before the others.

    Examples
    --------
    >>> nearest_first("lenght", ["area", "length", "width"])
    ['length', 'area', 'width']
    """
    first = nearest(word, allowed)
    return sorted(allowed, key=lambda other: other != first)


def did_you_mean(word: str, allowed: Iterable[str]) -> str | None:
    """The hint that names the nearest allowed word, or None if none is similar.

    Examples
    --------
    >>> did_you_mean("lenght", ["width", "length"])
    'did you mean length?'
    """
    word = nearest(word, allowed) or ""
    return f"did you mean {word}?" if word else None


def listing(words: Sequence[str], limit: int = 60) -> str:
    """The words as a list in a sentence, shortened when they are many.

    Examples
    --------
    >>> listing(["a", "b", "c", "d"], limit=2)
    'a, b, ... (4 in all)'
    """
    if len(words) <= limit:
        return ", ".join(words)
    return ", ".join([*words[:limit], f"... ({len(words)} in all)"])
