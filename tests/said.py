"""Messages on file: what is said of slips, in texts beside the tests.

A line that begins at the margin is a slip, below it stands the whole message: what came, what was
expected, where, what to write. The module of each text says how a slip is made of its line, and
writes the messages anew when it is run: a change that is meant shows as a difference of the text.
"""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import robostiff as rs

Told = dict[str, dict[str, str]]  # messages by heading and slip


def said(call: Callable[[str], Any], slip: str) -> str:
    """The warnings and the error of a slip, indented."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", rs.PlausibilityWarning)
        try:
            call(slip)
        except rs.RobostiffError as error:
            messages = [str(error)]
        else:
            messages = []
    messages = [f"warning: {own.message}" for own in caught] + messages
    assert messages, f"nothing is said of {slip}"
    return indented("\n".join(messages))


def indented(message: str) -> str:
    """A message as it stands on file."""
    return "".join(f"    {line}\n" for line in message.split("\n"))


def on_file(page: Path) -> Told:
    """What a text has."""
    found: Told = {}
    slips: dict[str, str] = {}
    slip = ""
    for line in page.read_text(encoding="utf-8").split("\n"):
        if line.startswith("== "):
            slips = found.setdefault(line.removeprefix("== "), {})
        elif line.startswith("    "):
            slips[slip] += f"{line}\n"
        elif line:
            slip = line
            assert slip not in slips, slip
            slips[slip] = ""
    return found


def now(told: Told, say: Callable[[str, str], str]) -> Told:
    """What is said now of the same slips under each heading."""
    return {kind: {slip: say(kind, slip) for slip in slips} for kind, slips in told.items()}


def write(page: Path, told: Told) -> None:
    """Write a text."""
    parts = (
        f"== {kind}\n" + "".join(f"{slip}\n{message}" for slip, message in slips.items())
        for kind, slips in told.items()
    )
    page.write_text("\n".join(parts), encoding="utf-8")
