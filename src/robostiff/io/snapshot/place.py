"""A place in a snapshot file, to be named when something there cannot be used."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.errors import FileError, InputError
from robostiff.io._problem import part
from robostiff.io.document import Document


@dataclass(frozen=True)
class Place:
    """A path in a document."""

    document: Document
    path: tuple[str | int, ...] = ()

    def at(self, *steps: str | int) -> Place:
        """A place further down."""
        return Place(self.document, (*self.path, *steps))

    @property
    def value(self) -> Any:
        """What the document says here."""
        return part(self.document.data, self.path)

    def error(
        self,
        subject: str,
        *,
        got: Any = None,
        expected: str | None = None,
        hint: str | None = None,
    ) -> FileError:
        """A complaint about what is here."""
        location = self.document.location(self.path)
        return FileError(location, subject, got=got, expected=expected, hint=hint)

    @contextmanager
    def to_blame(self) -> Iterator[None]:
        """Any complaint inside becomes one about this place; overflow is left to the checks."""
        try:
            with np.errstate(all="ignore"):
                yield
        except FileError:
            raise
        except InputError as error:
            # As the file has it, not as it was when it had become an array.
            got = self.value if isinstance(error.got, (list, np.ndarray)) else error.got
            raise self.error(
                error.subject, got=got, expected=error.expected, hint=error.hint
            ) from None
