"""Reading a document as a pydantic model; errors with file, line, column and advice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from robostiff.errors import FileError
from robostiff.io._problem import Problem, Rank, problem
from robostiff.io.document import Document

Model = TypeVar("Model", bound=BaseModel)
_MOST_OF_A_KIND = 100
_MOST_SHOWN = 20


def validate(model: type[Model], document: Document) -> Model:
    """Read a document as a file model.

    Parameters
    ----------
    model : type of pydantic.BaseModel
    document : Document

    Returns
    -------
    BaseModel
        An instance of `model`.

    Raises
    ------
    FileError
        At the most specific mistake: an unknown key before a wrong value before a missing key, and
        the deepest of them. An `InputError` of the model's own validators keeps its words.

    Examples
    --------
    >>> from pydantic import ConfigDict
    >>> from robostiff.io.document import parse_document
    >>> class Robot(BaseModel):
    ...     model_config = ConfigDict(extra="forbid")
    ...     length: float
    >>> validate(Robot, parse_document("length: 2.5"))
    Robot(length=2.5)
    >>> validate(Robot, parse_document("lenght: 2.5", file="robot.yaml"))
    Traceback (most recent call last):
    robostiff.errors.FileError: robot.yaml:1:1: lenght: unknown key: ...; did you mean length?
    """
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise _file_error(error, model, document) from None


def _file_error(error: ValidationError, model: type[BaseModel], document: Document) -> FileError:
    """The most specific mistake; further ones follow in the order of the file."""
    entries = error.errors(include_url=False)
    problems = [problem(dict(details), model, document.data) for details in _some(entries)]
    by_path: dict[tuple[str | int, ...], list[Problem]] = {}
    for found in sorted(problems, key=lambda found: (found.rank, -len(found.path))):
        own = by_path.setdefault(found.path, [])
        if not own or own[0].rank == found.rank:
            own.append(found)
    # A misspelt key is missing under its own name; and a mistake inside one member of a union makes
    # the other members report the whole value.
    follows = {found.meant for found in problems}
    follows |= {path[:k] for path in by_path for k in range(len(path))}
    chief, *rest = [path for path in by_path if path not in follows] or list(by_path)[:1]
    others = [_complaint(by_path[path], document) for path in rest]
    others.sort(key=lambda other: (other.location.line or 0, other.location.column or 0))
    uncounted = len(entries) - len(problems) + len(others[_MOST_SHOWN:])
    return _complaint(by_path[chief], document, others[:_MOST_SHOWN], uncounted)


def _some(entries: Sequence[Any]) -> list[Any]:
    """Of very many errors the first ones of each kind."""
    seen: Counter[str] = Counter()
    found = []
    for details in entries:
        seen[details["type"]] += 1
        if seen[details["type"]] <= _MOST_OF_A_KIND:
            found.append(details)
    return found


def _complaint(
    same: Sequence[Problem],
    document: Document,
    others: Sequence[FileError] = (),
    uncounted: int = 0,
) -> FileError:
    """The problems at one path as one error."""
    chief = same[0]
    path = chief.path
    unknown = chief.rank is Rank.UNKNOWN_KEY
    place = document.key_location(path) if unknown else document.location(path)
    subject, got, hint = chief.subject, chief.got, chief.hint
    expected = " or ".join(dict.fromkeys(found.expected for found in same if found.expected))
    if chief.cause is not None:
        subject, got, hint = chief.cause.subject, chief.cause.got, chief.cause.hint
        expected = chief.cause.expected or ""
    if isinstance(chief.cause, FileError):
        place = chief.cause.location
    return FileError(
        place,
        subject,
        got=got,
        expected=expected or None,
        hint=hint,
        others=others,
        uncounted=uncounted,
    )
