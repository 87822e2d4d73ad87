"""From a file or a text to a document."""

from __future__ import annotations

import functools
import os
import stat
import sys
from pathlib import Path

from robostiff.errors import FileError, Location
from robostiff.io.document.document import Document, Limits, Mark
from robostiff.io.document.json_text import json_marks, parse_json
from robostiff.io.document.yaml_text import line_and_column, parse_yaml
from robostiff.io.suggest import Words

_LIMITS = Limits()


def read_document(source: Path | str, limits: Limits = _LIMITS) -> Document:
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
    file = str(source)
    try:
        content = _standard_input(limits) if file == "-" else _file_bytes(source, limits)
    except FileError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(
            Location(file), "cannot read the file", got=Words(reason), expected="a readable file"
        ) from None
    return _parse_bytes(content, "<stdin>" if file == "-" else file, limits)


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


def _standard_input(limits: Limits) -> bytes:
    content = sys.stdin.buffer.read(limits.size + 1)
    if len(content) > limits.size:
        raise limits.too_large("<stdin>")
    return content


def _file_bytes(source: Path | str, limits: Limits) -> bytes:
    """The content of a file; its size is looked up first, and never more than the limit is read."""
    file = str(source)
    status = os.stat(source)
    if stat.S_ISDIR(status.st_mode):
        raise FileError(Location(file), "a folder", expected="a YAML or JSON file")
    if status.st_size > limits.size:
        raise limits.too_large(file, status.st_size)
    with open(source, "rb") as stream:
        content = stream.read(limits.size + 1)
    if len(content) > limits.size:
        raise limits.too_large(file)
    return content


def _parse_bytes(content: bytes, file: str, limits: Limits) -> Document:
    if len(content) > limits.size:
        raise limits.too_large(file, len(content))
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
