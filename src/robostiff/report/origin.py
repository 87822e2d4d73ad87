"""Where a report comes from: its title block, and the file that describes the robot."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robostiff.errors import InputError, PlausibilityWarning

_LONGEST = 120


@dataclass(frozen=True)
class TitleBlock:
    """What a report is filed under; lines that are left empty are not printed.

    Attributes
    ----------
    project, author, date, revision : str

    Raises
    ------
    InputError
        When a line is no text, or longer than a line.

    Examples
    --------
    >>> TitleBlock(project="Cell 4", revision="B").lines
    (('project', 'Cell 4'), ('revision', 'B'))
    """

    project: str = ""
    author: str = ""
    date: str = ""
    revision: str = ""

    def __post_init__(self) -> None:
        for name, text in vars(self).items():
            if not isinstance(text, str) or len(text) > _LONGEST:
                raise InputError(
                    f"{name} of a report",
                    got=text,
                    expected=f"text of at most {_LONGEST} characters",
                )

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Names and texts of the lines that are printed."""
        return tuple((name, text) for name, text in vars(self).items() if text.strip())


NO_TITLE_BLOCK = TitleBlock()


@dataclass(frozen=True)
class DescribedBy:
    """The files that describe a robot, as they were when the report was written.

    Attributes
    ----------
    name : str
        Of the first file.
    text : str
        What it says.
    files : mapping of str to str
        Names of all files that were read for the robot, the first among them, and the SHA-256 of
        each, by which a file is recognised.
    parameters : mapping of str to value
        As they are written in the first.
    changed : mapping of str to value
        Other values for some of them, with which the robot was computed.
    """

    name: str
    text: str
    files: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    changed: Mapping[str, Any] = field(default_factory=dict)


def described_by(
    path: str | Path, changed: Mapping[str, Any] | None = None, **options: Any
) -> DescribedBy | None:
    """The files of a robot; None where the first is no text.

    Parameters
    ----------
    path : str or path
        A model file, a snapshot, a robot description, or the name of a shipped robot.
    changed : mapping of str to value, optional
        Parameters that were given other values.
    side, allow_xacro
        As for `robostiff.load`, which reads the files once more.

    Raises
    ------
    InputError
        When there is no such file, or it cannot be used.
    """
    from robostiff.io.bounded_file import files_that_are_read
    from robostiff.io.document import parse_document
    from robostiff.robots import load, robot_file, shipped_names

    file = robot_file(str(path)) if str(path) in shipped_names() else Path(path)
    if not file.is_file():
        raise InputError("file of a report", got=str(path), expected="a file that is there")
    content = file.read_bytes()
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return None
    with warnings.catch_warnings(), files_that_are_read() as files:
        warnings.simplefilter("ignore", PlausibilityWarning)  # given when it was loaded
        load(path, changed, **options)
    whole = os.path.realpath(file)
    named = {file.name: hashlib.sha256(content).hexdigest()}
    for name in files.keys() - {whole}:
        named[os.path.relpath(name, os.path.dirname(whole))] = files[name]
    parameters: Any = {}
    if file.suffix.lower() in {".yaml", ".yml", ".json"}:
        data = parse_document(text, file.name).data
        parameters = data.get("parameters") if isinstance(data, dict) else {}
    known = parameters if isinstance(parameters, dict) else {}
    return DescribedBy(file.name, text, named, known, dict(changed or {}))
