"""Read YAML and JSON, as text or from a file, into documents.

YAML is read by its parse events: no constructors, tags, anchors or recursion.
"""

from __future__ import annotations

import functools
import json
import os
import re
import sys
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

from robostiff.errors import FileError, Location, Words
from robostiff.io.bounded_file import bounded_bytes, too_large
from robostiff.io.document.document import Builder, Document, Limits, Marks

# part of the parser's words: (what is wrong, what to do, whether the place is where it began)
_PLAIN_WORDS: tuple[tuple[str, str, str | None, bool], ...] = (
    (r"character '\\t'", "a tab where YAML needs spaces", "indent with spaces", False),
    (
        r"mapping values are not allowed|found (?:unexpected )?':'",
        "a colon that is not allowed here",
        "check the indentation of this line and the one above, or quote the text",
        False,
    ),
    (r"could not find expected ':'", "a key without a colon", "write key: value", True),
    (r"quoted scalar.*unexpected end", "a quoted text that is never closed", None, True),
    (r"flow sequence", "a list that lacks a comma or its ]", None, True),
    (r"flow mapping", "a mapping that lacks a comma or its }", None, True),
    (
        r"expected <block end>",
        "a line that does not fit the ones above",
        "check the indentation, and that a list has - and a mapping has key: value on every line",
        False,
    ),
    (r"cannot start any token", "a character that cannot begin a value", "quote the text", False),
    (r"unknown escape character", "an unknown escape", "use single quotes", False),
    (r"did not find expected alphabetic", "an anchor or alias without a name", "quote it", False),
    (r"document start", "something after the end of the document", None, False),
)


def syntax_error(error: Any, text: str, file: str) -> FileError:
    """The FileError for an error of the YAML parser."""
    position = getattr(error, "position", None)
    if isinstance(position, int):  # a control character
        line, column = line_and_column(text, position)
        got = text[position : position + 1]
        return FileError(
            Location(file, line, column), "control character", got=got, expected="printable text"
        )
    context, problem = (str(getattr(error, name, None) or "") for name in ("context", "problem"))
    complaint, hint, at_start = f"{context} {problem}".strip() or "not YAML", None, False
    for pattern, words, advice, where in _PLAIN_WORDS:
        if re.search(pattern, f"{context} {problem}"):
            complaint, hint, at_start = words, advice, where
            break
    marks = [getattr(error, name, None) for name in ("problem_mark", "context_mark")]
    problem_mark, context_mark = marks
    mark = (context_mark if at_start else None) or problem_mark or context_mark
    place = Location(file, mark.line + 1, mark.column + 1) if mark else Location(file)
    if at_start and problem_mark and mark and problem_mark.line != mark.line:
        complaint += f" (noticed in line {problem_mark.line + 1})"
    return FileError(place, complaint, hint=hint)


def line_and_column(text: str, position: int) -> tuple[int, int]:
    """1-based line and column of a position in a text."""
    return text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)


_INTEGER = re.compile(r"[-+]?[0-9]+")

_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")

_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")

_SPECIAL = re.compile(r"([-+]?)\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")

_WORDS = MappingProxyType(
    {
        **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
        **dict.fromkeys(("true", "True", "TRUE"), True),
        **dict.fromkeys(("false", "False", "FALSE"), False),
    }
)

_LONGEST_INTEGER = 18

_BRACKET = re.compile(r"[\[\]{}]")

_MOST_OPENED = 1000  # brackets: the scanner reads a line to its end before any of them counts

_LONG_TAG = re.compile(r"!\S{1000}")

_NO_TAG = "remove the word that begins with !"


def parse_yaml(text: str, file: str, limits: Limits) -> Builder:
    """The data and places of a YAML text."""
    from yaml import events as kinds

    if match := _LONG_TAG.search(text):  # over which the scanner takes quadratic time
        raise FileError(
            Location(file, *line_and_column(text, match.start())),
            "tag",
            got=Words("a word of more than 1000 characters that begins with !"),
            expected="a value without a tag",
            hint=_NO_TAG,
        )
    marks = text.count("\n") + text.count(",")
    for subject, count, words, most in (
        ("YAML file too large", len(text), "characters", limits.yaml_size),
        ("too many values in YAML", marks, "lines and commas", limits.yaml_marks),
    ):
        if count > most:
            got = Words(f"{count} {words}")
            hint = "write a file of that size as JSON"
            raise FileError(Location(file), subject, got=got, expected=f"at most {most}", hint=hint)
    opened = 0  # also in quotes and comments, where nobody writes so many
    for match in _BRACKET.finditer(text):
        opened += 1 if match[0] in "[{" else -1
        if opened > _MOST_OPENED:
            raise limits.exceeded("depth", Location(file, *line_and_column(text, match.start())))
    builder = Builder(file, limits)
    documents = 0
    for event in _events(text, file):
        line, column = event.start_mark.line + 1, event.start_mark.column + 1
        if isinstance(event, kinds.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise FileError(
                    Location(file, line, column),
                    "second document",
                    expected="one document in a file",
                    hint="remove the line --- or split the file",
                )
        elif isinstance(event, kinds.NodeEvent):
            _take_node(event, builder, line, column)
        elif isinstance(event, (kinds.MappingEndEvent, kinds.SequenceEndEvent)):
            builder.end()
    if not builder.marks:
        raise FileError(Location(file), "empty file", expected="a YAML or JSON document")
    return builder


def resolve_plain(text: str) -> Any:
    """The value of an unquoted YAML scalar (core schema of YAML 1.2); otherwise text."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return integer(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _BASED.fullmatch(text) and len(text) <= _LONGEST_INTEGER:
        return int(text, 0)
    if match := _SPECIAL.fullmatch(text):
        return float(match[0].replace(".", "", 1))
    return text


def yaml_of(data: Mapping[str, Any]) -> str:
    """Plain data as YAML, in their order, short lists and mappings on one line."""
    import yaml

    class Dumper(yaml.SafeDumper):
        """Quotes text that would be read as a number, or on other lines."""

        def text(self, value: str) -> yaml.ScalarNode:
            is_plain = value.isprintable() and isinstance(resolve_plain(value), str)
            style = None if is_plain else '"'
            return self.represent_scalar("tag:yaml.org,2002:str", value, style)

    Dumper.add_representer(str, Dumper.text)
    options: Any = {"default_flow_style": None, "sort_keys": False, "allow_unicode": True}
    return yaml.dump(data, Dumper=Dumper, width=120, **options)


def integer(digits: str) -> int | float:
    """A whole number; a float if it has more digits than a machine integer holds."""
    return int(digits) if len(digits) <= _LONGEST_INTEGER else float(digits)


def _events(text: str, file: str) -> Iterator[Any]:
    """Parse events of libyaml; the parser in Python, which is slow, has the words of errors."""
    import yaml

    in_python = yaml.SafeLoader
    try:
        try:
            yield from yaml.parse(text, getattr(yaml, "CSafeLoader", in_python))
        except yaml.YAMLError:
            for _ in yaml.parse(text, in_python):
                pass
            raise
    except yaml.YAMLError as error:
        raise syntax_error(error, text, file) from None
    except (ValueError, OverflowError, LookupError, AttributeError, TypeError) as error:
        # the scanner trips over some malformed escapes and directives
        raise FileError(
            Location(file), "not YAML", got=Words(str(error)), expected="a YAML document"
        ) from None


def _take_node(event: Any, builder: Builder, line: int, column: int) -> None:
    """Refuse anchors, aliases, tags and halves of characters; put anything else into the data."""
    kind, written = type(event).__name__, getattr(event, "value", "")
    if event.anchor is not None:
        is_alias = kind == "AliasEvent"
        raise FileError(
            builder.place(line, column),
            "alias" if is_alias else "anchor",
            got=f"*{event.anchor}" if is_alias else f"&{event.anchor}",
            expected="a value written out",
            hint="for a value used twice, define it under parameters:",
        )
    if event.tag is not None:
        got = str(event.tag).replace("tag:yaml.org,2002:", "!!")
        place = builder.place(line, column)
        raise FileError(place, "tag", got=got, expected="a value without a tag", hint=_NO_TAG)
    if not written.isascii() and any("\ud800" <= c <= "\udfff" for c in written):
        place = builder.place(line, column)
        raise FileError(place, "text", got=written, expected="whole Unicode characters")
    if kind != "ScalarEvent" and not builder.expects_key:
        builder.start([] if kind == "SequenceStartEvent" else {}, line, column)
        return
    plain = not getattr(event, "style", None)
    value = resolve_plain(written) if plain else written
    if not builder.expects_key:
        builder.value(value, line, column)
        return
    if kind != "ScalarEvent" or not isinstance(value, str):
        got = Words("a list or mapping" if kind != "ScalarEvent" else written or "nothing")
        hint = f'write "{written}":' if written else None
        raise FileError(builder.place(line, column), "key", got=got, expected="a text", hint=hint)
    builder.key(value, line, column)


# a string (perhaps not closed), a bracket, a comma, a colon, or a run of anything else
_PIECE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},:]|[^\s"\[\]{},:]++', re.DOTALL)
_STRUCTURE = re.compile(r'"(?:[^"\\]++|\\.)*+(?:"|\\?\Z)|[\[\]{},]', re.DOTALL)
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def parse_json(text: str, file: str, limits: Limits) -> Any:
    """The data of a JSON text."""
    depth, nodes = 0, 1  # bounded before the decoder, which recurses, sees the text
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

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        mapping = dict(pairs)
        if len(mapping) < len(pairs) or len(mapping) > limits.keys:
            json_marks(text, file, limits)  # raises, with the place
            raise FileError(Location(file), "duplicate key", expected="each key once")
        return mapping

    try:
        data = json.loads(text, object_pairs_hook=unique, parse_int=integer)
    except json.JSONDecodeError as error:
        place = Location(file, error.lineno, error.colno)
        raise FileError(place, f"not JSON: {error.msg}") from None
    if _SURROGATE.search(text):  # half of a character, which could not be written out again
        try:
            json.dumps(data, ensure_ascii=False).encode()
        except UnicodeEncodeError:
            raise FileError(
                Location(file), "text", got=Words(r"\ud800"), expected="whole Unicode characters"
            ) from None
    return data


def json_marks(text: str, file: str, limits: Limits) -> Marks:
    """The places in a text that the decoder has accepted."""
    builder = Builder(file, limits)
    line, line_start, previous = 1, 0, 0
    for piece in _PIECE.finditer(text):
        position, word = piece.start(), piece[0]
        newlines = text.count("\n", previous, position)
        if newlines:
            line, line_start = line + newlines, text.rfind("\n", previous, position) + 1
        previous, column = position, position - line_start + 1
        if word in ("[", "{"):
            builder.start([] if word == "[" else {}, line, column)
        elif word in ("]", "}"):
            builder.end()
        elif word not in (",", ":"):
            if builder.expects_key:
                builder.key(json.loads(word), line, column)
            else:
                builder.value(None, line, column)
    return builder.marks or {(): (1, 1)}


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
    if (position := content.find(b"\0")) >= 0:
        got = Words(f"a NUL byte at offset {position}")
        expected = "a YAML or JSON text in UTF-8"
        raise FileError(Location(file), "binary file", got=got, expected=expected)
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
    if text.lstrip().startswith("<"):
        got, hint = Words("XML"), "names of robot descriptions end in .urdf, .xacro, .xml or .mjcf"
        raise FileError(Location(file), "file", got=got, expected="YAML or JSON", hint=hint)
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


def _yaml_document(text: str, file: str, limits: Limits) -> Document:
    builder = parse_yaml(text, file, limits)
    return Document(builder.data, file, lambda: builder.marks)


def _json_document(text: str, file: str, limits: Limits) -> Document:
    data = parse_json(text, file, limits)
    return Document(data, file, functools.cache(lambda: json_marks(text, file, limits)))
