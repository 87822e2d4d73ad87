"""Model files with identified values in place of those that were in them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from copy import deepcopy
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.identification.unknowns import Unknown, UnknownKind, spring_values
from robostiff.io.document import Document, read_document
from robostiff.io.edited_file import AGREES, check_is_another, edited_lines, parameter_text
from robostiff.io.model_file import model_from_document
from robostiff.io.rigid_tree import key_of_joint, read_side
from robostiff.model import Robot
from robostiff.whole_file import whole_file

_DOCUMENTS = (".yaml", ".yml", ".json")


def write_values(
    identified: Mapping[Unknown, tuple[float, str]],
    robot: Robot,
    path: str | os.PathLike[str],
    source: str | os.PathLike[str],
) -> None:
    """Write a file of the robot with the values that were found, and their uncertainty behind them.

    Of a robot description this is its side file: a joint whose stiffness is that of a pattern gets
    an entry of its own. What is written is read again, and compared with what was found, before it
    gets its name. `identified` has values and comments behind them, `robot` these values; `source`
    is the file that is changed, or a robot description for the side file beside it.

    Raises InputError when a value has no place of its own in the file.
    """
    is_document = Path(source).suffix.lower() in _DOCUMENTS
    document = read_document(source) if is_document else read_side(Path(source))
    source, is_side = document.file, "legs" not in document.data
    check_is_another(path, source)
    changes: dict[tuple[Any, ...], tuple[str, str]] = {}
    entries: list[str] = []
    data = deepcopy(document.data)
    for unknown, (value, comment) in identified.items():
        text = f"{value:.12g} {unknown.unit}".strip()
        if unknown.kind is UnknownKind.COMPLIANCE and unknown.name != unknown.parameter:
            text = f"{1 / value:.12g} {unknown.stiffness_unit}"  # where a stiffness is written
        place = _place(document.data, unknown)
        if place is not None and place not in changes:
            if unknown.parameter and unknown.kind is not UnknownKind.COMPLIANCE:
                text = parameter_text(document, unknown.parameter, value)
            changes[place] = text, comment
            reduce(getitem, place[:-1], data)[place[-1]] = text
        elif place is None and is_side and (pattern := _pattern(document, unknown)) is not None:
            joint = unknown.name.partition("/")[2]
            entry = data["joints"][joint] = {**document.data["joints"][pattern], "stiffness": text}
            entries.append(f"{json.dumps(joint)}: {json.dumps(entry)}  # {comment}")
        else:
            is_zero = unknown.name.endswith(".zero")
            example = (
                "z2: 0 deg of a turn: [{z: z2}] before the joint"
                if is_zero
                else "c2: 2e-6 rad/(N m)"
            )
            raise InputError(
                f"place of {unknown.name!r}",
                got=Words(f"none of its own in {os.fspath(source)!r}"),
                expected="a parameter, or the stiffness of one drive",
                hint=f"write it as a parameter, such as {example}, and identify that",
            )
    lines = edited_lines(document, changes)
    if entries:
        first = document.key_location(["joints", next(iter(document.data["joints"]))])
        top, indent = (first.line or 1) - 1, (first.column or 1) - 1
        lines[top:top] = [" " * indent + entry for entry in entries]
    with whole_file(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")
        if not is_side:
            _check(identified, robot, draft, source)
        elif read_document(draft).data != data:
            raise _shared(source, "a value")


def _check(
    identified: Mapping[Unknown, tuple[float, str]],
    robot: Robot,
    written: Path,
    source: str | os.PathLike[str],
) -> None:
    """Raise unless a written file has the values that were found, and all others as before."""
    names = [unknown.parameter for unknown in identified if unknown.parameter]
    again = model_from_document(read_document(written), symbols=names)
    values, expected = spring_values(again.numeric), spring_values(robot)
    for unknown, (value, _) in identified.items():
        if unknown.parameter:
            expected[unknown.name], values[unknown.name] = value, again.nominal[unknown.parameter]
            if unknown.name != unknown.parameter:
                values[unknown.name] = 1 / values[unknown.name]
    for name, value in expected.items():
        if not np.isclose(values.get(name, np.nan), value, rtol=AGREES, atol=0):
            raise _shared(source, name)


def _shared(source: str | os.PathLike[str], name: str) -> InputError:
    return InputError(
        f"values of {os.fspath(source)!r}",
        got=Words(f"{name}, which shares its place in the file with others"),
        expected="a place of its own for each value",
        hint="give it a parameter of the file, or identify with shared=True",
    )


def _place(data: Mapping[str, Any], unknown: Unknown) -> tuple[Any, ...] | None:
    """Path of what an unknown is written in; None where there is none."""
    if unknown.parameter:
        named = unknown.parameter in data.get("parameters", {})
        return ("parameters", unknown.parameter) if named else None
    if unknown.kind is not UnknownKind.COMPLIANCE:
        return None
    leg, _, part = unknown.name.partition("/")
    if "legs" not in data:  # a side file, of one joint by its name
        entry = data.get("joints", {}).get(part, {})
        return ("joints", part, "stiffness") if "stiffness" in entry else None
    legs = data["legs"]
    several: list[tuple[tuple[int, ...], Any]] = [((), legs)]  # a pattern of all of them, or each
    if isinstance(legs, list):
        several = [((i,), entries) for i, entries in enumerate(legs) if entries.get("name") == leg]
    for at, entries in several:
        chain: Any = entries.get("chain")
        for j, element in enumerate(chain if isinstance(chain, list) else ()):
            if element.get("name") == part and "stiffness" in element:
                return ("legs", *at, "chain", j, "stiffness")
    return None


def _pattern(document: Document, unknown: Unknown) -> str | None:
    """The pattern of a side file that gives a joint its stiffness; it has a line of its own."""
    if unknown.parameter or unknown.kind is not UnknownKind.COMPLIANCE:
        return None
    joint, entries = unknown.name.partition("/")[2], document.data.get("joints", {})
    key = key_of_joint(entries, joint)
    if key is None or key == joint or "stiffness" not in entries[key]:
        return None
    begins = [document.key_location(["joints", *path]).line for path in ([], [next(iter(entries))])]
    return key if begins[0] != begins[1] else None
