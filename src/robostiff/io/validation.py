"""Reading a document as a pydantic model; errors with file, line, column and advice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from robostiff.errors import FileError
from robostiff.io._problem import Problem, Rank, part, problem
from robostiff.io.document import Document

Model = TypeVar("Model", bound=BaseModel)
_MOST_OF_A_KIND = 100


def validate(model: type[Model], document: Document, at: Sequence[str | int] = ()) -> Model:
    """Read a document, or a part of it, as a file model.

    Parameters
    ----------
    model : type of pydantic.BaseModel
    document : Document
    at : sequence of str and int
        Path of the part to read; the whole document when left out.

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
        return model.model_validate(part(document.data, at))
    except ValidationError as error:
        raise file_error(error, model, document, at) from None


def file_error(
    error: ValidationError,
    model: type[BaseModel],
    document: Document,
    at: Sequence[str | int] = (),
    data: Any = None,
) -> FileError:
    """The validation error of a model as an error in a file.

    Parameters
    ----------
    error : pydantic.ValidationError
        Of `model`.
    model : type of pydantic.BaseModel
    document : Document
        For places.
    at : sequence of str and int
        Path in the document of what was validated.
    data
        What was validated, if it is not what the document says there but came from it by some
        conversion.

    Returns
    -------
    FileError
        For the most specific mistake; others are counted.
    """
    data = part(document.data, at) if data is None else data
    entries = error.errors(include_url=False)
    problems = [problem(dict(details), model, data) for details in _some(entries)]
    chief = min(problems, key=lambda found: (found.rank, -len(found.path)))
    same = [found for found in problems if found.path == chief.path and found.rank == chief.rank]
    complaint = _complaint(chief, same, document, at)
    others = {found.path for found in problems} - {chief.path, chief.meant}
    # A mistake inside one member of a union makes the other members report the whole value.
    others = {path for path in others if path != chief.path[: len(path)]}
    count = len(others) + len(entries) - len(problems)
    return _with_count(complaint, count) if count else complaint


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
    chief: Problem, same: Sequence[Problem], document: Document, at: Sequence[str | int]
) -> FileError:
    path = (*at, *chief.path)
    unknown = chief.rank is Rank.UNKNOWN_KEY
    place = document.key_location(path) if unknown else document.location(path)
    if isinstance(chief.cause, FileError):
        return chief.cause
    if chief.cause is not None:
        return FileError.from_input_error(place, chief.cause)
    expected = " or ".join(dict.fromkeys(found.expected for found in same if found.expected))
    return FileError(
        place, chief.subject, got=chief.got, expected=expected or None, hint=chief.hint
    )


def _with_count(error: FileError, others: int) -> FileError:
    """The error with the number of further errors."""
    count = f"{others} more error{'s' * (others > 1)}"
    hint = f"{error.hint} (and {count})" if error.hint else f"and {count}"
    return FileError(
        error.location, error.subject, got=error.got, expected=error.expected, hint=hint
    )
