"""Robots that come with robostiff, one model file each."""

from __future__ import annotations

from pathlib import Path

from robostiff.errors import InputError
from robostiff.frozen import frozen

_HERE = Path(__file__).parent
_FOLDERS = ("", "cables", "linkages")
_HEADER = ("robostiff:", "name:", "title:", "source:", "notes:", " ", "#", "\n")


@frozen
class RobotInfo:
    """Facts about a shipped robot.

    Attributes
    ----------
    name : str
    title : str
        In a line.
    source : str
        Where its numbers come from.
    """

    name: str
    title: str
    source: str


def shipped_robots() -> tuple[str, ...]:
    """Names of the robots with legs that come with robostiff, in alphabetical order.

    Examples
    --------
    >>> "gough-stewart-b" in shipped_robots()
    True
    """
    return _names_in("")


def shipped_cable_robots() -> tuple[str, ...]:
    """Names of the cable robots that come with robostiff, in alphabetical order.

    Examples
    --------
    >>> "cable-8" in shipped_cable_robots()
    True
    """
    return _names_in("cables")


def shipped_linkages() -> tuple[str, ...]:
    """Names of the linkages that come with robostiff, in alphabetical order.

    Their loops are not made of legs: `load` gives a network, `load_linkage` what can be moved.

    Examples
    --------
    >>> shipped_linkages()
    ('double-pantograph',)
    """
    return _names_in("linkages")


def robot_file(name: str) -> Path:
    """The model file of a shipped robot, to read or to copy.

    Raises
    ------
    InputError
        When no shipped robot has this name.
    """
    for folder in _FOLDERS:
        if name in _names_in(folder):
            return _HERE / folder / f"{name}.yaml"
    raise unknown_robot(name, "the name of a shipped robot")


def describe(name: str) -> RobotInfo:
    """Title and source of a shipped robot; only the head of its file is read.

    Raises
    ------
    InputError
        When no shipped robot has this name.
    """
    from robostiff.io.document import parse_document

    file = robot_file(name)
    head = []
    for line in file.read_text(encoding="utf-8").splitlines(keepends=True):
        if not line.startswith(_HEADER):
            break
        head.append(line)
    data = parse_document("".join(head), str(file)).data
    return RobotInfo(name, data["title"], data["source"])


def _names_in(folder: str) -> tuple[str, ...]:
    return tuple(sorted(file.stem for file in (_HERE / folder).glob("*.yaml")))


def shipped_names() -> tuple[str, ...]:
    """Names of all that comes with robostiff."""
    return tuple(name for folder in _FOLDERS for name in _names_in(folder))


def unknown_robot(name: str, expected: str, hint: str | None = None) -> InputError:
    """The error for a name that no shipped robot has, with the nearest names."""
    from robostiff.io.suggest import did_you_mean, listing, nearest_first

    names = shipped_names()
    return InputError(
        "robot",
        got=name,
        expected=f"{expected}: {listing(nearest_first(name, names))}",
        hint=hint or did_you_mean(name, names),
    )
