"""JSON by Python's fast decoder; locations are determined afterwards, when they are needed."""

from __future__ import annotations

import json
import re
from functools import partial
from typing import Any

from robostiff.errors import FileError, Location
from robostiff.io.document.document import Builder, Limits, Mark
from robostiff.io.document.yaml_text import integer, line_and_column

# a string (perhaps not closed), a bracket, a comma, a colon, or a run of anything else
_PIECE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},:]|[^\s"\[\]{},:]++', re.DOTALL)
_STRUCTURE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},]', re.DOTALL)
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


class _DuplicateKey(Exception):
    """Some mapping has a key twice, or too many keys."""


def parse_json(text: str, file: str, limits: Limits) -> Any:
    """The data of a JSON text.

    Raises
    ------
    FileError
        At the first thing that is no JSON, or that goes over the limits.
    """
    _check_structure(text, file, limits)
    try:
        unique = partial(_unique, most=limits.keys)
        data = json.loads(text, object_pairs_hook=unique, parse_int=integer)
    except json.JSONDecodeError as error:
        place = Location(file, error.lineno, error.colno)
        raise FileError(place, f"not JSON: {error.msg}") from None
    except _DuplicateKey:
        json_marks(text, file, limits)  # raises, with the place
        raise FileError(Location(file), "duplicate key", expected="each key once") from None
    if _SURROGATE.search(text):
        _check_characters(data, file)
    return data


def json_marks(text: str, file: str, limits: Limits) -> Mark:
    """The places in a text that the decoder has accepted."""
    builder = Builder(file, limits)
    line, line_start, seen = 1, 0, 0
    for piece in _PIECE.finditer(text):
        position, word = piece.start(), piece[0]
        newlines = text.count("\n", seen, position)
        if newlines:
            line, line_start = line + newlines, text.rfind("\n", seen, position) + 1
        seen, column = position, position - line_start + 1
        if word in ("[", "{"):
            builder.start([] if word == "[" else {}, line, column)
        elif word in ("]", "}"):
            builder.end()
        elif word not in (",", ":"):
            if builder.expects_key:
                builder.key(json.loads(word), line, column)
            else:
                builder.scalar(None, line, column)
    return builder.mark or Mark(1, 1)


def _check_structure(text: str, file: str, limits: Limits) -> None:
    """Bound nesting and size before the decoder, which recurses, sees the text."""
    depth, nodes = 0, 1
    for piece in _STRUCTURE.finditer(text):
        character = piece[0]
        if character in ("[", "{"):
            depth += 1
            nodes += 1
            if depth > limits.depth:
                place = Location(file, *line_and_column(text, piece.start()))
                raise limits.too_deep(place)
        elif character in ("]", "}"):
            depth -= 1
        elif character == ",":
            nodes += 1
        if nodes > limits.nodes:
            raise limits.too_many(Location(file, *line_and_column(text, piece.start())))


def _unique(pairs: list[tuple[str, Any]], most: int) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs) or len(mapping) > most:
        raise _DuplicateKey
    return mapping


def _check_characters(data: Any, file: str) -> None:
    """Refuse halves of characters, which could not be written out again."""
    try:
        json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise FileError(
            Location(file), "text", got=r"\ud800", expected="whole Unicode characters"
        ) from None
