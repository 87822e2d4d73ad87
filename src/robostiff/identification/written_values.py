"""Model files with identified values in place of those that were in them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import InputError
from robostiff.identification.unknowns import Unknown, UnknownKind, spring_values
from robostiff.io.document import Document, read_document
from robostiff.io.model_file import model_from_document
from robostiff.model import Robot
from robostiff.whole_file import whole_file

_VALUE = re.compile(r"\"[^\"]*\"|'[^']*'|[^,}\]#\n]*[^,}\]#\n\s]")
# Of a value as it is written: what digits leave.
_AGREES = 1e-9


def write_values(
    found: Mapping[Unknown, tuple[float, str]],
    robot: Robot,
    path: str | os.PathLike[str],
    source: str | os.PathLike[str],
) -> None:
    """Write a model file with the values that were found, and their uncertainty behind them.

    What is written is read again, and compared with what was found, before it gets its name.

    Parameters
    ----------
    found : mapping of Unknown to (float, str)
        Values, and comments behind them.
    robot : Robot
        With these values.
    path, source : path
        The new file, and the one that is changed.

    Raises
    ------
    InputError
        When a value has no place of its own in the file.
    """
    document = read_document(source)
    lines = Path(source).read_text(encoding="utf-8").splitlines()
    comments: dict[int, list[str]] = {}
    edits: list[tuple[int, int, int, str]] = []
    for own, (value, comment) in found.items():
        place = _place(document, own)
        if place is None:
            raise _no_place(own, source)
        at = document.location(place)
        line, column = (at.line or 1) - 1, (at.column or 1) - 1
        match = _VALUE.match(lines[line], column)
        if match is None or any(edit[:2] == (line, column) for edit in edits):
            raise _no_place(own, source)
        text = f"{value:.12g} {own.unit}".strip()
        if own.kind is UnknownKind.COMPLIANCE and own.name != own.parameter:
            # a stiffness where one is written
            unit = "N m/rad" if own.unit.startswith("rad") else "N/m"
            text = f"{1 / value:.12g} {unit}"
        edits.append((line, column, match.end(), text))
        comments.setdefault(line, []).append(comment)
    for line, start, end, text in sorted(edits, reverse=True):
        lines[line] = lines[line][:start] + text + lines[line][end:]
    for line, words in comments.items():
        lines[line] += ("  # " if "#" not in lines[line] else "; ") + "; ".join(words)
    with whole_file(path) as begun:
        begun.write_text("\n".join(lines) + "\n", encoding="utf-8")
        # what is written has the values that were found, and all others as before
        names = [own.parameter for own in found if own.parameter]
        again = model_from_document(read_document(begun), symbols=names)
        values, expected = spring_values(again.numeric), spring_values(robot)
        for own, (value, _) in found.items():
            if own.parameter:
                expected[own.name], values[own.name] = value, again.nominal[own.parameter]
                if own.name != own.parameter:
                    values[own.name] = 1 / values[own.name]
        for name, value in expected.items():
            if not np.isclose(values.get(name, np.nan), value, rtol=_AGREES, atol=0):
                raise InputError(
                    f"values of {os.fspath(source)!r}",
                    got=f"{name}, which shares its place in the file with others",
                    expected="a place of its own for each value",
                    hint="give it a parameter of the file, or identify with shared=True",
                )


def _no_place(own: Unknown, source: str | os.PathLike[str]) -> InputError:
    return InputError(
        f"place of {own.name!r}",
        got=f"none of its own in {os.fspath(source)!r}",
        expected="a parameter, or the stiffness of one drive",
        hint="write it as a parameter, such as c2: 2e-6 rad/(N m), and identify that",
    )


def _place(document: Document, own: Unknown) -> list[Any] | None:
    """Path of what an unknown is written in; None where there is none."""
    data = document.data
    if own.parameter:
        return ["parameters", own.parameter] if own.parameter in data["parameters"] else None
    if own.kind is not UnknownKind.COMPLIANCE:
        return None
    leg, _, part = own.name.partition("/")
    legs = data["legs"]
    several = enumerate(legs) if isinstance(legs, list) else [(None, legs)]
    for i, one in several:
        if i is not None and one.get("name") != leg:
            continue
        chain: Sequence[Any] = one["chain"] if isinstance(one.get("chain"), list) else ()
        for j, element in enumerate(chain):
            if element.get("name") == part and "stiffness" in element:
                return ["legs", *([] if i is None else [i]), "chain", j, "stiffness"]
    return None
