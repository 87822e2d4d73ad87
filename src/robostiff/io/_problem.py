"""One complaint of a file model, in the words and at the path of the document."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any, get_args

from pydantic import BaseModel

from robostiff.errors import InputError
from robostiff.io._model_trace import Step, Trace, keys, tags, trace
from robostiff.io._wording import WORDING, shown, values
from robostiff.io.suggest import Words, did_you_mean, listing, nearest


class Rank(IntEnum):
    """Kinds of mistake, the most telling first."""

    UNKNOWN_KEY = 0
    WRONG_VALUE = 1
    MISSING_KEY = 2


@dataclass(frozen=True)
class Problem:
    """What is wrong, and where.

    Attributes
    ----------
    rank : Rank
    path : tuple of str and int
        From the top of what was validated.
    subject, got, expected, hint
        As in `InputError`.
    meant : tuple of str and int, or None
        Path of the key that a misspelt key was meant to be.
    cause : InputError or None
        What a validator of the model said; it keeps its words.
    """

    rank: Rank
    path: tuple[Step, ...]
    subject: str
    got: Any = None
    expected: str | None = None
    hint: str | None = None
    meant: tuple[Step, ...] | None = None
    cause: InputError | None = None


def problem(details: Mapping[str, Any], model: type[BaseModel], data: Any) -> Problem:
    """One entry of ``ValidationError.errors()`` in plain words."""
    found = trace(model, data, details["loc"])
    return _KINDS.get(details["type"], _wrong_value)(found, details, data)


def part(data: Any, path: Sequence[Step]) -> Any:
    """The value at a path.

    Examples
    --------
    >>> part({"legs": [{"name": "left"}]}, ["legs", 0, "name"])
    'left'
    """
    for step in path:
        data = data[step]
    return data


def _unknown_key(found: Trace, _: Mapping[str, Any], data: Any) -> Problem:
    *parent, key = found.path
    present = part(data, parent)
    allowed = keys(found.model) if found.model else []
    meant = nearest(str(key), [word for word in allowed if word not in present])
    return Problem(
        Rank.UNKNOWN_KEY,
        found.path,
        "unknown key",
        expected=_one_of(allowed) if allowed else "no key here",
        hint=f"did you mean {meant}?" if meant else None,
        meant=(*parent, meant) if meant else None,
    )


def _missing(found: Trace, details: Mapping[str, Any], _: Any) -> Problem:
    key = found.path[-1]
    if isinstance(key, int):  # too short a list for a tuple
        came, wanted = len(details["input"]), len(get_args(found.container))
        return _wrong(found.path[:-1], Words(values(came)), values(wanted), "wrong length")
    fields = found.model.model_fields.items() if found.model else ()
    words = [field.description for name, field in fields if key in (name, field.alias)]
    hint = f"{key} is {words[0]}" if words and words[0] else None
    return Problem(Rank.MISSING_KEY, found.path, "missing key", hint=hint)


def _missing_tag(found: Trace, details: Mapping[str, Any], _: Any) -> Problem:
    name, value = _discriminator(details), details["input"]
    if not isinstance(value, dict):
        return _wrong(found.path, shown(value), "a mapping")
    words = _one_of(list(tags(found.annotation, name)))
    return Problem(Rank.MISSING_KEY, (*found.path, name), "missing key", expected=words)


def _unknown_tag(found: Trace, details: Mapping[str, Any], _: Any) -> Problem:
    name = _discriminator(details)
    allowed = list(tags(found.annotation, name))
    return _unknown_word(details["input"].get(name), allowed, (*found.path, name))


def _unknown_literal(found: Trace, details: Mapping[str, Any], _: Any) -> Problem:
    allowed = get_args(found.annotation) or [member.value for member in found.annotation]
    return _unknown_word(details["input"], [str(word) for word in allowed], found.path)


def _unknown_word(value: Any, words: list[str], path: tuple[Step, ...]) -> Problem:
    expected = " or ".join(map(repr, words)) if len(words) <= 3 else _one_of(words)
    hint = did_you_mean(value, words) if isinstance(value, str) else None
    return _wrong(path, shown(value), expected, "unknown word", hint)


def _wrong_value(found: Trace, details: Mapping[str, Any], _: Any) -> Problem:
    value, context = details["input"], details.get("ctx", {})
    cause, phrase = context.get("error"), WORDING.get(details["type"])
    if isinstance(cause, InputError):
        return Problem(Rank.WRONG_VALUE, found.path, cause.subject, cause=cause)
    if phrase is not None:
        return Problem(Rank.WRONG_VALUE, found.path, *phrase(value, context, found.metadata))
    return _wrong(found.path, shown(value), None, str(cause or details["msg"]))


def _wrong(
    path: tuple[Step, ...],
    got: Any,
    expected: str | None,
    subject: str = "wrong value",
    hint: str | None = None,
) -> Problem:
    return Problem(Rank.WRONG_VALUE, path, subject, got, expected, hint)


def _discriminator(details: Mapping[str, Any]) -> str:
    return str(details["ctx"]["discriminator"]).strip("'")


def _one_of(words: list[str]) -> str:
    return f"one of {listing(words)}" if len(words) > 1 else "".join(words)


_KINDS: Mapping[str, Callable[[Trace, Mapping[str, Any], Any], Problem]] = MappingProxyType(
    {
        "extra_forbidden": _unknown_key,
        "missing": _missing,
        "union_tag_not_found": _missing_tag,
        "union_tag_invalid": _unknown_tag,
        "literal_error": _unknown_literal,
        "enum": _unknown_literal,
    }
)
