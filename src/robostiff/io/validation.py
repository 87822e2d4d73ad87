"""Reading a document as a pydantic model; errors with file, line, column and advice."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from enum import IntEnum
from functools import reduce
from operator import getitem
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, RootModel, Tag, ValidationError
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema

from robostiff.errors import UNSAID, FileError, InputError, Location, Words
from robostiff.frozen import frozen
from robostiff.io.document import Document
from robostiff.io.suggest import as_in_a_file, did_you_mean, listing, nearest, phrase, values

Step = str | int


def plain(annotation: Any, metadata: tuple[Any, ...] = ()) -> tuple[Any, tuple[Any, ...]]:
    """A type without Annotated, alias, ``| None`` and root model around it; and its metadata."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation, *more = get_args(annotation)
            # Every Field(...) is replaced by its contents.
            more = [x for y in more for x in (y.metadata if isinstance(y, FieldInfo) else (y,))]
            metadata = (*more, *metadata)
        elif hasattr(annotation, "__value__"):  # a type alias
            annotation = annotation.__value__
        elif isinstance(annotation, type) and issubclass(annotation, RootModel):
            annotation = annotation.model_fields["root"].annotation
        elif _is_union(annotation) and len(members(annotation)) == 1:
            (annotation,) = members(annotation)
        else:
            if (
                _is_model(annotation)
                and not annotation.__pydantic_fields_complete__
                and annotation.model_config.get("defer_build")
            ):
                annotation.model_rebuild()  # of elements that hold elements, written before these
            return annotation, metadata


def _is_union(annotation: Any) -> bool:
    return get_origin(annotation) in (Union, UnionType)


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def members(annotation: Any) -> tuple[Any, ...]:
    """The members of a union, None aside."""
    return tuple(member for member in get_args(annotation) if member is not NoneType)


def tags(annotation: Any, discriminator: str | None = None) -> Iterator[str]:
    """The tags that distinguish the members of a union."""
    for member in members(annotation) if _is_union(annotation) else (annotation,):
        kind, metadata = plain(member)
        yield from (str(item.tag) for item in metadata if isinstance(item, Tag))
        if _is_union(kind):
            yield from tags(kind, discriminator)
        elif _is_model(kind):
            for name, field in kind.model_fields.items():
                literal = get_origin(field.annotation) is Literal
                if literal and discriminator in (None, name, field.alias):
                    yield from (str(word) for word in get_args(field.annotation))


def _member(annotation: Any, label: Step) -> tuple[Any, tuple[Any, ...]]:
    """The member of a union that a label names; ``Any`` if it names none."""
    for member in members(annotation):
        kind, metadata = plain(member)
        names = [str(item.tag) for item in metadata if isinstance(item, Tag)]
        if label in names or label == getattr(kind, "__name__", None):
            return kind, metadata
        if label in list(tags(member)):
            return _member(kind, label) if _is_union(kind) else (kind, metadata)
    for member in members(annotation):
        kind, metadata = plain(member)
        origin = getattr(get_origin(kind), "__name__", None)
        if _is_union(kind) or (origin and str(label).startswith(f"{origin}[")):
            return kind, metadata
    return Any, ()


def _child(annotation: Any, step: Step) -> tuple[bool, tuple[Any, tuple[Any, ...]]]:
    """Whether a type says what is at a step; the type that is there."""
    unknown = (Any, ())
    if _is_model(annotation):
        for name, field in annotation.model_fields.items():
            if step in (name, field.alias):
                return True, plain(field.annotation, tuple(field.metadata))
        return True, unknown
    origin, arguments = get_origin(annotation), get_args(annotation)
    if not isinstance(origin, type) or not arguments:
        return False, unknown
    if issubclass(origin, Mapping):
        return step != "[key]", plain(arguments[-1])
    if issubclass(origin, Sequence) and isinstance(step, int):
        is_uniform = origin is not tuple or arguments[-1] is Ellipsis
        kind = arguments[0] if is_uniform else arguments[min(step, len(arguments) - 1)]
        return True, plain(kind)
    return False, unknown


class Rank(IntEnum):
    """Kinds of mistake, the most specific first."""

    UNKNOWN_KEY = 0
    WRONG_VALUE = 1
    MISSING_KEY = 2


@frozen
class Problem:
    """A mistake and its location."""

    path: tuple[Step, ...]  # from the top of what was validated
    # as in `InputError`
    got: Any = UNSAID
    expected: str | None = None
    subject: str = "wrong value"
    hint: str | None = None
    rank: Rank = Rank.WRONG_VALUE
    meant: tuple[Step, ...] | None = None  # path of the key that a misspelt key was meant to be
    location: Location | None = None  # where a validator of the model found it


def _problem(details: Mapping[str, Any], model: type[BaseModel], data: Any) -> Problem:
    """An entry of ``ValidationError.errors()`` at its location, in words.

    Its ``loc`` is followed through the model, and through the data where that says nothing; labels
    by which pydantic distinguishes the members of a union are no part of the path.
    """
    annotation, metadata = plain(model)
    container: Any = None
    node: Any = data
    path: tuple[Step, ...] = ()
    for step in details["loc"]:
        if _is_union(annotation):
            annotation, metadata = _member(annotation, step)
            continue
        known, child = _child(annotation, step)
        is_there = isinstance(node, dict) and step in node
        if isinstance(node, list) and isinstance(step, int):
            is_there = 0 <= step < len(node)
        if known or is_there:
            path, container = (*path, step), annotation
            node = node[step] if is_there else None
            annotation, metadata = child
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if kind in ("extra_forbidden", "missing"):
        return _problem_of_key(value, path, container, data, unknown=kind == "extra_forbidden")
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return _problem_of_tag(value, str(context["discriminator"]).strip("'"), path, annotation)
    if kind in ("literal_error", "enum"):
        allowed = get_args(annotation) or [member.value for member in annotation]
        return _unknown_word(value, [str(word) for word in allowed], path)
    cause = context.get("error")
    if isinstance(cause, InputError):  # of a validator of the model: it keeps its words
        parts = cause.got, cause.expected, cause.subject, cause.hint
        return Problem(path, *parts, location=getattr(cause, "location", None))
    words = phrase(kind, value, context, metadata)
    return Problem(
        path, *(words or (as_in_a_file(value), None, str(cause or details["msg"]), None))
    )


def _problem_of_key(
    value: Any, path: tuple[Step, ...], container: Any, data: Any, *, unknown: bool
) -> Problem:
    """A key that is unknown or missing; or too short a list for a tuple."""
    *parent, key = path
    fields: Any = container.model_fields.items() if _is_model(container) else ()
    if unknown:
        present = reduce(getitem, parent, data)
        required_first = sorted(fields, key=lambda item: not item[1].is_required())
        allowed = [field.alias or name for name, field in required_first]
        absent = [word for word in allowed if word not in present]
        # Without its space, or its colon, YAML takes a value as a part of the key.
        word, rest = [*re.split(r"\s*[:=\s]\s*", str(key), maxsplit=1), ""][:2]
        meant = word if rest and word in absent else nearest(str(key), absent)
        hint = f"write {word}: {rest}, with a colon and a space" if rest and meant == word else None
        return Problem(
            path,
            expected=_one_of(allowed) if allowed else "no key here",
            subject="unknown key",
            hint=hint or (f"did you mean {meant}?" if meant else None),
            rank=Rank.UNKNOWN_KEY,
            meant=(*parent, meant) if meant else None,
        )
    if isinstance(key, int):
        came, wanted = len(value), len(get_args(container))
        return Problem(tuple(parent), Words(values(came)), values(wanted), "wrong length")
    words = [field.description for name, field in fields if key in (name, field.alias)]
    hint = f"{key} is {words[0]}" if words and words[0] else None
    return Problem(path, UNSAID, None, "missing key", hint, Rank.MISSING_KEY)


def _problem_of_tag(value: Any, name: str, path: tuple[Step, ...], annotation: Any) -> Problem:
    """A mapping without the word that says of which kind it is, or with another word."""
    if not isinstance(value, dict):
        return Problem(path, as_in_a_file(value), "a mapping")
    allowed, key = list(tags(annotation, name)), (*path, name)
    if name in value:
        return _unknown_word(value[name], allowed, key)
    return Problem(key, UNSAID, _one_of(allowed), "missing key", rank=Rank.MISSING_KEY)


def _unknown_word(value: Any, words: list[str], path: tuple[Step, ...]) -> Problem:
    expected = " or ".join(map(repr, words)) if len(words) <= 3 else _one_of(words)
    hint = did_you_mean(value, words) if isinstance(value, str) else None
    return Problem(path, as_in_a_file(value), expected, "unknown word", hint)


def _one_of(words: list[str]) -> str:
    return f"one of {listing(words)}" if len(words) > 1 else "".join(words)


class WithoutTitles(GenerateJsonSchema):
    """A generator that leaves out titles that only repeat the key."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """False: titles of fields only repeat their keys."""
        return False


Model = TypeVar("Model", bound=BaseModel)
_MOST_OF_A_KIND = 100
_MOST_SHOWN = 20


def validate(model: type[Model], document: Document) -> Model:
    """Read a document as a file model.

    Raises FileError at the most specific mistake: an unknown key before a wrong value before a
    missing key, and the deepest of them. An `InputError` of the model's own validators keeps its
    words.
    """
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        entries = error.errors(include_url=False)
    seen: Counter[str] = Counter()
    selected = []  # of very many the first ones of each kind
    for details in entries:
        seen[details["type"]] += 1
        if seen[details["type"]] <= _MOST_OF_A_KIND:
            selected.append(details)
    data = document.data
    problems = [_problem(dict(entry), model, data) for entry in selected]
    by_path: dict[tuple[str | int, ...], list[Problem]] = {}
    for problem in sorted(problems, key=lambda p: (p.rank, -len(p.path))):
        same = by_path.setdefault(problem.path, [])
        if not same or same[0].rank == problem.rank:
            same.append(problem)
    # A misspelt key is missing under its own name; and a mistake inside one member of a union makes
    # the other members report the whole value.
    follows = {p.meant for p in problems}
    follows |= {path[:k] for path in by_path for k in range(len(path))}
    chief, *rest = [path for path in by_path if path not in follows] or list(by_path)[:1]
    others = [_complaint(by_path[path], document) for path in rest]
    others.sort(key=lambda other: (other.location.line or 0, other.location.column or 0))
    uncounted = len(entries) - len(problems) + len(others[_MOST_SHOWN:])
    raise _complaint(by_path[chief], document, others[:_MOST_SHOWN], uncounted)


def _complaint(
    same: Sequence[Problem],
    document: Document,
    others: Sequence[FileError] = (),
    uncounted: int = 0,
) -> FileError:
    """The problems at one path as one error."""
    chief, path, hint = same[0], same[0].path, same[0].hint
    locate = document.key_location if chief.rank is Rank.UNKNOWN_KEY else document.location
    expected = " or ".join(dict.fromkeys(problem.expected for problem in same if problem.expected))
    # YAML cuts an expression at a comma, as in [max(a, b), 0, 0].
    pieces: list[Any] = [*path[-1:]]
    with suppress(LookupError, TypeError):  # a key that is missing
        value = reduce(getitem, path, document.data)
        pieces += value if isinstance(value, list) else []
    if any(isinstance(piece, str) and piece.count("(") != piece.count(")") for piece in pieces):
        hint = 'write an expression with commas in quotes, such as "atan2(h, b)"'
    return FileError(
        chief.location or locate(path),
        chief.subject,
        got=chief.got,
        expected=expected or None,
        hint=hint,
        others=others,
        uncounted=uncounted,
    )
