"""Where a report comes from: its title block, and the file that describes the robot."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robostiff.errors import InputError

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
    """The file that describes a robot, as it was when the report was written.

    Attributes
    ----------
    name : str
        Of the file.
    text : str
    parameters : mapping of str to value
        As they are written in it.
    changed : mapping of str to value
        Other values for some of them, with which the robot was computed.
    """

    name: str
    text: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    changed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def digest(self) -> str:
        """SHA-256 of the text, by which a file is recognised."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def described_by(path: str | Path, changed: Mapping[str, Any] | None = None) -> DescribedBy | None:
    """The file of a robot; None where it is no text.

    Parameters
    ----------
    path : str or path
        A model file, a snapshot, or the name of a shipped robot.
    changed : mapping of str to value, optional
        Parameters that were given other values.

    Raises
    ------
    InputError
        When there is no such file.
    """
    from robostiff.io.document import parse_document
    from robostiff.robots import (
        robot_file,
        shipped_cable_robots,
        shipped_linkages,
        shipped_robots,
    )

    shipped = (*shipped_robots(), *shipped_cable_robots(), *shipped_linkages())
    file = robot_file(str(path)) if str(path) in shipped else Path(path)
    if not file.is_file():
        raise InputError("file of a report", got=str(path), expected="a file that is there")
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None
    parameters: Any = {}
    if file.suffix.lower() in {".yaml", ".yml", ".json"}:
        data = parse_document(text, file.name).data
        parameters = data.get("parameters") if isinstance(data, dict) else {}
    known = parameters if isinstance(parameters, dict) else {}
    return DescribedBy(file.name, text, known, dict(changed or {}))
