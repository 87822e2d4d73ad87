"""Finding and reading the side file of a robot description."""

from __future__ import annotations

from pathlib import Path

from robostiff.errors import FileError, InputError
from robostiff.io.document import Document, read_document
from robostiff.io.model_file.written_robot import VERSION
from robostiff.io.suggest import Words

_ENDINGS = (".xacro", ".urdf", ".xml", ".mjcf")
_EXAMPLE = (
    "write robostiff: 1, source: where the numbers come from, tool: the name of a link, joints: "
    '{"*": {stiffness: 1e4 N m/rad}}, or the like'
)


def side_file_of(description: Path) -> Path:
    """Where the side file of a robot description is looked for.

    Examples
    --------
    >>> side_file_of(Path("cell/arm.urdf.xacro")).name
    'arm.stiffness.yaml'
    """
    name = description.name
    for ending in _ENDINGS:
        name = name[: -len(ending)] if name.lower().endswith(ending) else name
    return description.with_name(f"{name}.stiffness.yaml")


def read_side(description: Path | str, side: Path | str | None = None) -> Document:
    """The side file of a robot description.

    Parameters
    ----------
    description : path or str
    side : path or str, optional
        The side file; the one beside the description when left out, which is called like it with
        the ending ``.stiffness.yaml``.

    Raises
    ------
    InputError
        When there is none; a `FileError` when it cannot be read or is no side file.
    """
    if side is None:
        found = side_file_of(Path(description))
        if not found.exists():
            raise InputError(
                f"stiffness of {str(description)!r}",
                got=Words("no side file"),
                expected=f"{found} beside it, or another file by side=, --side on the command line",
                hint=f"there {_EXAMPLE}",
            )
        side = found
    document = read_document(side)
    _check(document)
    return document


def _check(document: Document) -> None:
    """Raise unless the document begins as a side file of this version does."""
    data = document.data
    if not isinstance(data, dict) or "robostiff" not in data:
        raise FileError(
            document.location(), "side file", expected="robostiff: 1 at the top", hint=_EXAMPLE
        )
    version = data["robostiff"]
    if version != VERSION or isinstance(version, bool):
        raise FileError(
            document.location(("robostiff",)),
            "version of the side file",
            got=version,
            expected=str(VERSION),
            hint="this file needs a newer robostiff"
            if isinstance(version, int) and version > VERSION
            else None,
        )
    if "legs" in data:
        raise FileError(
            document.key_location(("legs",)),
            "side file",
            got=Words("a model file with legs of its own"),
            expected="what a robot description cannot say",
            hint=_EXAMPLE,
        )
