"""YAML read by its parse events: no constructors, tags, anchors or recursion; and written."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from io import StringIO
from types import MappingProxyType
from typing import Any

from robostiff.errors import FileError, Location
from robostiff.io.document.document import Builder, Limits
from robostiff.io.suggest import Words

# part of the parser's words: (what is wrong, what to do, whether the place is where it began)
_PLAIN_WORDS: tuple[tuple[str, str, str | None, bool], ...] = (
    (r"character '\\t'", "a tab where YAML needs spaces", "indent with spaces", False),
    (
        r"mapping values are not allowed",
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
        return FileError(
            Location(file, line, column),
            "control character",
            got=text[position : position + 1],
            expected="printable text",
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
    from ruamel.yaml import events as kinds

    if found := _LONG_TAG.search(text):  # over which the scanner takes quadratic time
        raise FileError(
            Location(file, *line_and_column(text, found.start())),
            "tag",
            got=Words("a word of more than 1000 characters that begins with !"),
            expected="a value without a tag",
            hint=_NO_TAG,
        )
    limits.check_yaml(text, file)
    opened = 0  # also in quotes and comments, where nobody writes so many
    for found in _BRACKET.finditer(text):
        opened += 1 if found[0] in "[{" else -1
        if opened > _MOST_OPENED:
            raise limits.exceeded("depth", Location(file, *line_and_column(text, found.start())))
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
            _check_node(event, builder, line, column)
            _add_node(event, builder, line, column)
        elif isinstance(event, (kinds.MappingEndEvent, kinds.SequenceEndEvent)):
            builder.end()
    if builder.mark is None:
        raise FileError(Location(file), "empty file", expected="a YAML or JSON document")
    return builder


def resolve_plain(text: str) -> Any:
    """The value of an unquoted YAML scalar (core schema of YAML 1.2); otherwise text.

    Examples
    --------
    >>> [resolve_plain(word) for word in ("1e8", "0x10", "true", "~", "yes", "1_000", "300 mm")]
    [100000000.0, 16, True, None, 'yes', '1_000', '300 mm']
    """
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return integer(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _BASED.fullmatch(text) and len(text) <= _LONGEST_INTEGER:
        return int(text, 0)
    if found := _SPECIAL.fullmatch(text):
        return float(found[0].replace(".", "", 1))
    return text


def yaml_of(data: Mapping[str, Any]) -> str:
    """Plain data as YAML, in their order, short lists and mappings on one line.

    Examples
    --------
    >>> print(yaml_of({"name": "jack", "end": [0.0, 0.0, 1.0]}), end="")
    name: jack
    end: [0.0, 0.0, 1.0]
    """
    from ruamel.yaml import YAML

    yaml, text = YAML(), StringIO()
    yaml.default_flow_style, yaml.width = None, 120
    yaml.dump(data, text)
    return text.getvalue()


def integer(digits: str) -> int | float:
    """A whole number; a float if it has more digits than a machine integer holds."""
    return int(digits) if len(digits) <= _LONGEST_INTEGER else float(digits)


def _events(text: str, file: str) -> Iterator[Any]:
    from ruamel.yaml import YAML, YAMLError

    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except YAMLError as error:
        raise syntax_error(error, text, file) from None
    except (ValueError, OverflowError, LookupError, AttributeError, TypeError) as error:
        # the scanner trips over some malformed escapes and directives
        raise FileError(
            Location(file), "not YAML", got=Words(str(error)), expected="a YAML document"
        ) from None


def _check_node(event: Any, builder: Builder, line: int, column: int) -> None:
    """Refuse anchors, aliases, tags and halves of characters."""
    text = getattr(event, "value", "")
    halved = not text.isascii() and any("\ud800" <= c <= "\udfff" for c in text)
    if event.anchor is None and event.tag is None and not halved:
        return
    place = builder.place(line, column)
    if event.anchor is not None:
        is_alias = type(event).__name__ == "AliasEvent"
        raise FileError(
            place,
            "alias" if is_alias else "anchor",
            got=f"*{event.anchor}" if is_alias else f"&{event.anchor}",
            expected="a value written out",
            hint="for a value used twice, define it under parameters:",
        )
    if event.tag is not None:
        got = str(event.tag).replace("tag:yaml.org,2002:", "!!")
        raise FileError(place, "tag", got=got, expected="a value without a tag", hint=_NO_TAG)
    raise FileError(place, "text", got=text, expected="whole Unicode characters")


def _add_node(event: Any, builder: Builder, line: int, column: int) -> None:
    kind = type(event).__name__
    if kind != "ScalarEvent" and not builder.expects_key:
        builder.start([] if kind == "SequenceStartEvent" else {}, line, column)
        return
    written = getattr(event, "value", "")
    plain = getattr(event, "style", None) is None
    value = resolve_plain(written) if plain else written
    if not builder.expects_key:
        builder.scalar(value, line, column)
        return
    if kind != "ScalarEvent" or not isinstance(value, str):
        raise FileError(
            builder.place(line, column),
            "key",
            got=Words("a list or mapping" if kind != "ScalarEvent" else written or "nothing"),
            expected="a text",
            hint=f'write "{written}":' if written else None,
        )
    builder.key(value, line, column)
