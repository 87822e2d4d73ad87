"""Exceptions: messages contain the value, what was expected and what to write instead."""

from __future__ import annotations

import sys
import unicodedata
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from robostiff.frozen import frozen

# Control and format characters (bidirectional marks among them), surrogates, line separators.
_UNSHOWN = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def printable(text: str, kept: str = "") -> str:
    r"""Text with control characters and directions as escapes.

    Parameters
    ----------
    text : str
        Such as a name from a file, which may hold anything.
    kept : str
        Characters that stay, such as ``"\n"``.
    """
    if text.isprintable():
        return text
    return "".join(
        c
        if c in kept or unicodedata.category(c) not in _UNSHOWN
        else c.encode("unicode_escape").decode("ascii")
        for c in text
    )


class RobostiffError(Exception):
    """Base of every exception that robostiff raises on purpose."""

    def __str__(self) -> str:
        return printable(super().__str__(), kept="\n\t")


class Words(str):
    """Text that a message shows without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


UNSAID = Words("")
"""In place of what came, where a message is silent about it; None came where a caller gave None."""


_MOST_SHOWN = 100  # entries, which are longer than what is shown of them


class InputError(RobostiffError, ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    subject : str
        What is wrong, in words (``"outer diameter"``, ``"spring stiffness"``).
    got : object, optional
        What came; nothing is said of it by default.
    expected : str, optional
        What was expected.
    hint : str, optional
        What to write instead.

    Examples
    --------
    >>> print(InputError("length", got=-0.3, expected="a positive number", hint="write 0.3"))
    length: got -0.3, expected a positive number; write 0.3
    """

    def __init__(
        self,
        subject: str,
        *,
        got: Any = UNSAID,
        expected: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.subject = subject
        self.got: Any = got
        self.expected = expected
        self.hint = hint
        super().__init__(self.message())

    def message(self) -> str:
        """The error in one sentence."""
        facts, got = [], self.got
        # Arrays and their numbers are shown as a user would write them; of long ones the beginning.
        if type(got).__module__ == "numpy":
            got = (got[(slice(_MOST_SHOWN),) * got.ndim] if got.ndim else got).tolist()
        is_long = isinstance(got, list | tuple) and len(got) > _MOST_SHOWN
        shown = repr(got[:_MOST_SHOWN] if is_long else got)
        # What is shown without quotes is a sentence, perhaps of another program.
        limit = 600 if isinstance(got, str) and shown == got else 80
        if shown:  # UNSAID shows nothing
            facts.append(f"got {shown if len(shown) <= limit else shown[: limit - 1] + '…'}")
        if self.expected is not None:
            facts.append(f"expected {self.expected}")
        text = self.subject
        if facts:
            text += ": " + ", ".join(facts)
        if self.hint is not None:
            text += "; " + self.hint
        return text


@frozen
class Location:
    """Where in a file: 1-based line and column, and the path inside (``legs[0].chain[2].axis``)."""

    file: str
    line: int | None = None
    column: int | None = None
    path: str = ""

    def __str__(self) -> str:
        place = self.file
        if self.line is not None:
            place += f":{self.line}"
            if self.column is not None:
                place += f":{self.column}"
        return f"{place}: {self.path}" if self.path else place


class FileError(InputError):
    """A file that cannot be used, with the location of the error.

    Parameters
    ----------
    location : Location
    subject, got, expected, hint
        As of `InputError`.
    others : sequence of FileError
        Further mistakes in the file; each is a line of the message.
    uncounted : int
        How many more there are beside those.
    """

    def __init__(
        self,
        location: Location,
        subject: str,
        *,
        got: Any = UNSAID,
        expected: str | None = None,
        hint: str | None = None,
        others: Sequence[FileError] = (),
        uncounted: int = 0,
    ) -> None:
        self.location = location
        self.others: tuple[FileError, ...] = tuple(others)
        self.uncounted = uncounted
        super().__init__(subject, got=got, expected=expected, hint=hint)

    @classmethod
    def from_input_error(cls, location: Location, error: InputError) -> FileError:
        """The same error, with its location in a file."""
        return cls(location, error.subject, got=error.got, expected=error.expected, hint=error.hint)

    def message(self) -> str:
        """The location, then the error; further ones on lines of their own."""
        lines = [f"{self.location}: {super().message()}", *(o.message() for o in self.others)]
        if self.uncounted:
            lines.append(f"and {self.uncounted} more error{'s' * (self.uncounted > 1)}")
        return "\n".join(lines)


@contextmanager
def needs_extra(what: str, extra: str) -> Iterator[None]:
    """Turn an import that fails into a message that names what to install.

    Parameters
    ----------
    what : str
        What needs the import, such as ``"plots"``.
    extra : str
        Of this package, with which its packages are installed.

    Raises
    ------
    InputError
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        raise InputError(
            f"{what} need {package!r}, which is not installed",
            hint=f"write pip install 'robostiff[{extra}]'",
        ) from None


class PlausibilityWarning(UserWarning):
    """Input that can be used, but is probably a slip, or of which a part is not read."""


def warn_of_slip(text: str) -> None:
    """Show a `PlausibilityWarning` at the line of the user's that called this package."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("robostiff"):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, PlausibilityWarning, stacklevel=level)


class OpenAtHomeError(InputError):
    """A leg does not close in the home configuration of the robot."""


class NoAnswerError(RobostiffError):
    """A result has no such quantity; the message gives status and advice."""


class TooFewDigitsError(NoAnswerError):
    """A method has an answer, of which rounding leaves too few digits."""


class DisagreementError(RobostiffError):
    """Two methods of robostiff disagree: one of them is wrong, and neither result is returned.

    Parameters
    ----------
    subject : str
        What was computed in two ways, and which ways.
    distance : float or str
        How far apart the answers are, relative; or both of them in words.
    where : str
        Robot and pose.

    Examples
    --------
    >>> print(DisagreementError("K by record and by wrench basis form", 0.15, "'delta' at home"))
    K by record and by wrench basis form disagree by 1.5e-01 for 'delta' at home; one is wrong, ...
    """

    def __init__(self, subject: str, distance: float | str, where: str) -> None:
        self.subject = subject
        self.distance = distance
        self.where = where
        apart = distance if isinstance(distance, str) else f"by {distance:.1e}"
        super().__init__(
            f"{subject} disagree {apart} for {where}; one is wrong, which is a fault of robostiff: "
            "please report it with the model file"
        )
