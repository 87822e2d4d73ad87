"""The YAML parser's complaints in plain words."""

from __future__ import annotations

import re
from typing import Any

from robostiff.errors import FileError, Location

# part of the parser's words: (what is wrong, what to do, whether the place is where it began)
_PLAIN_WORDS: tuple[tuple[str, str, str | None, bool], ...] = (
    (r"character '\\t'", "a tab where YAML wants spaces", "indent with spaces", False),
    (
        r"mapping values are not allowed",
        "a colon that does not fit here",
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
