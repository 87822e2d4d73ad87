"""Words for messages: lists, the nearest allowed word, and values as they were written."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from types import MappingProxyType
from typing import Any

#: subject, what came, what was expected, hint
Phrase = tuple[str, Any, str | None, str | None]
_LENGTHS = ("min_length", "max_length")

Phrasing = Callable[[Any, Mapping[str, Any], tuple[Any, ...]], Phrase]


def shown(value: Any) -> Any:
    """A value as it is written in a file.

    Examples
    --------
    >>> shown(None), shown(True), shown([1, 2]), shown("text")
    (null, true, a list of 2 values, 'text')
    """
    match value:
        case None:
            return Words("null")
        case bool():
            return Words(str(value).lower())
        case dict():
            return Words("a mapping")
        case list():
            return Words(f"a list of {values(len(value))}")
    return value


def _wrong(expected: str) -> Phrasing:
    def phrase(value: Any, _: Mapping[str, Any], __: tuple[Any, ...]) -> Phrase:
        return "wrong value", shown(value), expected, None

    return phrase


def _number(expected: str) -> Phrasing:
    def phrase(value: Any, _: Mapping[str, Any], __: tuple[Any, ...]) -> Phrase:
        hint = "write it without quotes" if isinstance(value, str) and _is_number(value) else None
        return "wrong value", shown(value), expected, hint

    return phrase


def _bound(words: str, key: str) -> Phrasing:
    def phrase(value: Any, context: Mapping[str, Any], _: tuple[Any, ...]) -> Phrase:
        bound = context[key]
        positive = key == "gt" and bound == 0
        return "wrong value", value, "a positive number" if positive else f"{words} {bound:g}", None

    return phrase


def _length(words: str, key: str) -> Phrasing:
    def phrase(value: Any, context: Mapping[str, Any], metadata: tuple[Any, ...]) -> Phrase:
        bound = context[key]
        bounds = {getattr(item, name, None) for item in metadata for name in _LENGTHS}
        exactly = bounds - {None} == {bound} and len(metadata) > 1
        exactly = exactly or context.get("field_type") == "Tuple"
        expected = values(bound) if exactly else f"{words} {values(bound)}"
        return "wrong length", Words(values(len(value))), expected, None

    return phrase


def _text_length(words: str, key: str) -> Phrasing:
    def phrase(value: Any, context: Mapping[str, Any], _: tuple[Any, ...]) -> Phrase:
        bound = context[key]
        return "wrong value", value, f"{words} {bound} character{'s' * (bound != 1)}", None

    return phrase


def _pattern(value: Any, context: Mapping[str, Any], _: tuple[Any, ...]) -> Phrase:
    return "wrong value", value, f"a text of the form {context['pattern']}", None


def values(number: int) -> str:
    """A number of values as text."""
    return f"{number} value{'s' * (number != 1)}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_A_MAPPING, _A_LIST = _wrong("a mapping"), _wrong("a list")
_A_NUMBER, _AN_INTEGER = _number("a number"), _number("a whole number")
_A_TEXT, _A_BOOL = _wrong("a text"), _wrong("true or false")

#: By the ``type`` of an entry of ``ValidationError.errors()``.
WORDING: Mapping[str, Phrasing] = MappingProxyType(
    {
        "model_type": _A_MAPPING,
        "model_attributes_type": _A_MAPPING,
        "dict_type": _A_MAPPING,
        "mapping_type": _A_MAPPING,
        "list_type": _A_LIST,
        "tuple_type": _A_LIST,
        "float_type": _A_NUMBER,
        "float_parsing": _A_NUMBER,
        "finite_number": _number("a finite number"),
        "int_type": _AN_INTEGER,
        "int_parsing": _AN_INTEGER,
        "int_from_float": _AN_INTEGER,
        "string_type": _A_TEXT,
        "bool_type": _A_BOOL,
        "bool_parsing": _A_BOOL,
        "none_required": _wrong("null"),
        "greater_than": _bound("a number above", "gt"),
        "greater_than_equal": _bound("a number of at least", "ge"),
        "less_than": _bound("a number below", "lt"),
        "less_than_equal": _bound("a number of at most", "le"),
        "too_short": _length("at least", "min_length"),
        "too_long": _length("at most", "max_length"),
        "string_too_short": _text_length("a text of at least", "min_length"),
        "string_too_long": _text_length("a text of at most", "max_length"),
        "string_pattern_mismatch": _pattern,
    }
)


_LONGEST_WORD = 60
_MOST_CANDIDATES = 1000
_SHORTEST_BEGINNING = 3


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
    >>> nearest("gough", ["hexapod", "gough-stewart-a"])
    'gough-stewart-a'
    """
    candidates = list(islice(allowed, _MOST_CANDIDATES))
    if len(word) > _LONGEST_WORD:
        return None
    for candidate in candidates:
        if candidate.casefold() == word.casefold():
            return candidate
    close = difflib.get_close_matches(word, candidates, n=1)
    if not close and len(word) >= _SHORTEST_BEGINNING:
        start = word.casefold()
        close = [own for own in candidates if own.casefold().startswith(start)]
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


def numbered(names: Sequence[str | None], kinds: Sequence[str]) -> list[str]:
    """The names; in place of none the kind and the next number that makes a free one.

    Examples
    --------
    >>> numbered([None, "beam1", None], ["beam", "beam", "beam"])
    ['beam2', 'beam1', 'beam3']
    """
    count: Counter[str] = Counter()
    found = []
    for name, kind in zip(names, kinds, strict=True):
        own = name
        while own is None or (name is None and own in names):
            count[kind] += 1
            own = f"{kind}{count[kind]}"
        found.append(own)
    return found
