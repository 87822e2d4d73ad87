"""Read YAML and JSON, as text or from a file, into documents."""

from __future__ import annotations

import functools
import json
import os
import re
import sys
from functools import partial
from typing import Any

from robostiff.errors import FileError, Location
from robostiff.io.document.document import Builder, Document, Limits, Mark
from robostiff.io.document.yaml_text import integer, line_and_column, parse_yaml
from robostiff.io.suggest import Words
from robostiff.io.whole_file import bounded_bytes, too_large

# a string (perhaps not closed), a bracket, a comma, a colon, or a run of anything else
_PIECE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},:]|[^\s"\[\]{},:]++', re.DOTALL)
_STRUCTURE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},]', re.DOTALL)
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


class _DuplicateKey(Exception):
    """Some mapping has a key twice, or too many keys."""


def parse_json(text: str, file: str, limits: Limits) -> Any:
    """The data of a JSON text."""
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
            depth, nodes = depth + 1, nodes + 1
        elif character == ",":
            nodes += 1
        else:
            depth -= character in ("]", "}")
        if depth > limits.depth or nodes > limits.nodes:
            bound = "depth" if depth > limits.depth else "nodes"
            raise limits.exceeded(bound, Location(file, *line_and_column(text, piece.start())))


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


_LIMITS = Limits()


def read_document(source: str | os.PathLike[str], limits: Limits = _LIMITS) -> Document:
    """Read a YAML or JSON file.

    Parameters
    ----------
    source : path or str
        The file; ``-`` for standard input.
    limits : Limits
        Bounds on its size.

    Raises
    ------
    FileError
        If the file cannot be read, is too large, or is neither YAML nor JSON; also for anchors,
        aliases, tags, duplicate keys, keys that are no text, and a second document.

    See Also
    --------
    parse_document : for a text.
    """
    if str(source) != "-":
        content = bounded_bytes(source, limits.size, "a YAML or JSON file")
        return _parse_bytes(content, str(source), limits)
    return _parse_bytes(sys.stdin.buffer.read(limits.size + 1), "<stdin>", limits)


def parse_document(text: str, file: str = "<text>", limits: Limits = _LIMITS) -> Document:
    r"""Read a YAML or JSON text.

    Parameters
    ----------
    text : str
        JSON if the name ends in ``.json``; otherwise JSON is tried if it begins with ``{``.
    file : str
        The name for messages.
    limits : Limits
        Bounds on its size.

    Raises
    ------
    FileError
        As for `read_document`.

    Examples
    --------
    >>> parse_document("R: 300 mm\nlegs: [1, 2.5, true]").data
    {'R': '300 mm', 'legs': [1, 2.5, True]}
    """
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        place = Location(file, *line_and_column(text, error.start))
        raise FileError(place, "text", expected="whole Unicode characters") from None
    return _parse_bytes(content, file, limits)


def _parse_bytes(content: bytes, file: str, limits: Limits) -> Document:
    if len(content) > limits.size:
        raise too_large(Location(file), len(content), limits.size)
    text = _decoded(content, file)
    if file.lower().endswith(".json"):
        return _json_document(text, file, limits)
    if text.lstrip().startswith("{"):
        try:
            return _json_document(text, file, limits)
        except FileError as not_json:
            try:
                return _yaml_document(text, file, limits)  # {R: 300 mm} is YAML
            except FileError:
                raise not_json from None
    return _yaml_document(text, file, limits)


def _decoded(content: bytes, file: str) -> str:
    if (position := content.find(b"\0")) >= 0:
        raise FileError(
            Location(file),
            "binary file",
            got=Words(f"a NUL byte at offset {position}"),
            expected="a YAML or JSON text in UTF-8",
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8", errors="replace")
        raise FileError(
            Location(file, *line_and_column(before, len(before))),
            "not UTF-8",
            got=Words(f"the byte 0x{content[error.start]:02x}"),
            expected="a YAML or JSON text in UTF-8",
            hint="save the file as UTF-8",
        ) from None
    if not text.strip():
        raise FileError(Location(file), "empty file", expected="a YAML or JSON document")
    return text


def _yaml_document(text: str, file: str, limits: Limits) -> Document:
    builder = parse_yaml(text, file, limits)
    mark = builder.mark or Mark(1, 1)
    return Document(builder.data, file, lambda: mark)


def _json_document(text: str, file: str, limits: Limits) -> Document:
    data = parse_json(text, file, limits)
    return Document(data, file, functools.cache(lambda: json_marks(text, file, limits)))
