"""Model files with other values in the places of those that were in them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

import numpy as np

from robostiff.errors import InputError
from robostiff.io.document import Document, read_document
from robostiff.io.expression import parameter_values, parse
from robostiff.io.units import parse_quantity
from robostiff.whole_file import whole_file

_VALUE = re.compile(r"\"[^\"]*\"|'[^']*'|[^,}\]#\n]*[^,}\]#\n\s]")
_UNIT = re.compile(r"[\s+-]*[\d.]+(?:[eE][+-]?\d+)?\s*(.*)", re.DOTALL)
#: Of a value as it is written: what digits leave.
AGREES = 1e-9


def check_is_another(path: str | os.PathLike[str], source: str | os.PathLike[str]) -> None:
    """Raise where a file would be written in place of the one that it is made from."""
    if os.path.realpath(path) == os.path.realpath(source):
        raise InputError("file to write", got=os.fspath(path), expected="a new file")


def edited_lines(
    document: Document, changes: Mapping[tuple[str | int, ...], tuple[str, str]]
) -> list[str]:
    """Lines of a file with other values, by their paths in it, and comments behind the lines.

    Other comments, order, and quotes of values stay. Raises InputError where a value does not stand
    in one line.
    """
    with open(document.file, encoding="utf-8") as file:
        lines = file.read().splitlines()
    comments: dict[int, list[str]] = {}
    edits = []
    for place, (text, comment) in changes.items():
        at = document.location(place)
        line, column = (at.line or 1) - 1, (at.column or 1) - 1
        match = _VALUE.match(lines[line], column)
        if match is None:
            raise InputError(f"value of {at.path}", got=lines[line], expected="a value in one line")
        quote = match[0][0] if match[0][0] in "\"'" else ""
        edits.append((line, column, match.end(), f"{quote}{text}{quote}"))
        comments.setdefault(line, []).extend([comment] if comment else [])
    for line, start, end, text in sorted(edits, reverse=True):
        lines[line] = lines[line][:start] + text + lines[line][end:]
    for line, words in comments.items():
        if words:
            lines[line] += ("  # " if "#" not in lines[line] else "; ") + "; ".join(words)
    return lines


def parameter_text(document: Document, name: str, value: float) -> str:
    """A value [SI] of a parameter, in the unit in which its file has it."""
    parameters = document.data["parameters"]
    written, unit, factor = str(parameters[name]), "", 1.0
    match = _UNIT.match(written)
    if match and parse(written).is_quantity:
        unit = match[1].strip()
        factor = parse_quantity(f"1 {unit}").magnitude
    else:
        quantity = parameter_values(parameters)[name]
        if not quantity.is_bare:
            unit = quantity.dimension.si_unit if quantity.dimension else str(quantity.units)
    return f"{value / factor:.12g} {unit}".strip()


def write_parameters(
    values: Mapping[str, float], path: str | os.PathLike[str], source: str | os.PathLike[str]
) -> None:
    """Write a model file with other values of parameters [SI], as a new file.

    Comments, order and units stay. What is written is read again, and compared, before it gets its
    name.

    Raises
    ------
    InputError
        When the file has no such parameter, or would be written over.
    """
    check_is_another(path, source)
    document = read_document(source)
    parameters = document.data.get("parameters", {})
    expected = parameter_values(parameters, values)
    changes: dict[tuple[str | int, ...], tuple[str, str]] = {
        ("parameters", name): (parameter_text(document, name, value), "")
        for name, value in values.items()
    }
    with whole_file(path) as draft:
        draft.write_text("\n".join(edited_lines(document, changes)) + "\n", encoding="utf-8")
        data = read_document(draft).data
        again = parameter_values(data["parameters"])
        agree = [np.isclose(again[name].magnitude, quantity.magnitude, rtol=AGREES, atol=0)
                 for name, quantity in expected.items()]  # fmt: skip
        if not all(agree) or {**data, "parameters": parameters} != document.data:
            got = ", ".join(values)
            expected = "a place of its own for each value"
            raise InputError(f"parameters of {os.fspath(source)!r}", got=got, expected=expected)
